"""What certificates say."""

import hashlib
import json
from dataclasses import replace

import numpy as np
import pytest

from tests.unit.report.builders import make_report, make_run
from thermaxis.codes import Message
from thermaxis.errors import ConfigurationError
from thermaxis.files import DecisionRule, FigureLimits
from thermaxis.files.settings import HEADER_FIELDS
from thermaxis.messages import sentence_of
from thermaxis.positioning import (
    FIGURE_KEYS,
    Cycle,
    Edition,
    PositioningTest,
    StartEnd,
    evaluate_iso230_2,
    evaluate_iso230_2_1988,
    evaluate_vdi_dgq_3441,
)
from thermaxis.quantities import AxisKind
from thermaxis.report import FIGURE_NAMES, PositioningReport, check_limits, unshowable
from thermaxis.report._document import Document, Fields, ItemList, Signature, Table, Verdict
from thermaxis.report.certificate._certificate import build_certificate
from thermaxis.report.tables import as_json, describe_evaluation, results_json, results_sha256

LIMITS = FigureLimits(
    {"B": 4.0, "A": 20.0, "R": 30.0},
    DecisionRule.ISO14253_1,
    {"B": 0.3, "A": 0.8, "R": 1.0},
    "limits.toml",
)


def document_of(report: PositioningReport) -> Document:
    return build_certificate(report, {})


def section_of(document: Document, words: str) -> str:
    """Return all text of the first section whose heading has these words."""
    section = next(s for s in document.sections if words in s.heading)
    return f"{section.heading} {section.blocks}"


def result_rows(document: Document) -> list[tuple[str, ...]]:
    table = next(b for b in document.opening if isinstance(b, Table))
    return list(table.rows)


def notes_of(document: Document) -> str:
    return " ".join(next(b for b in document.sections[0].blocks if isinstance(b, ItemList)).items)


def verdict_of(document: Document) -> Verdict:
    return next(block for block in document.opening if isinstance(block, Verdict))


def fields_of(report: PositioningReport) -> dict[str, str]:
    """Return the labelled values of the conditions of the test."""
    document = document_of(report)
    section = next(s for s in document.sections if s.heading.startswith("Conditions"))
    groups = [block for block in section.blocks if isinstance(block, Fields)]
    return {label: value for group in groups for label, value in group.fields}


@pytest.fixture(scope="module")
def small() -> PositioningReport:
    return make_report(make_run(), limits=LIMITS)


@pytest.fixture(scope="module")
def small_document(small: PositioningReport) -> Document:
    return document_of(small)


def test_the_result_table_has_the_figures_in_the_order_of_the_standard(
    small: PositioningReport, small_document: Document
) -> None:
    rows = result_rows(small_document)
    assert [row[0] for row in rows] == [
        *("B", "B̄", "M"),
        *("E↑", "E↓", "E"),
        *("R↑", "R↓", "R"),
        *("A↑", "A↓", "A"),
    ]
    assert [row[2] for row in rows] == [
        f"{getattr(small.iso230_2, key):.{1 if key == 'R' else 2}f}"  # its U is 1.0
        for key in FIGURE_KEYS
    ]


def test_a_limited_figure_has_its_uncertainty_limit_and_verdict(small_document: Document) -> None:
    by_symbol = {row[0]: row[3:] for row in result_rows(small_document)}
    assert by_symbol["B"] == ("0.30", "2.00", "4.00", "pass")
    assert by_symbol["R"] == ("1.0", "2.00", "30.0", "pass")
    assert by_symbol["A"] == ("0.80", "2.00", "20.00", "pass")
    assert by_symbol["M"] == ("not evaluated", "", "", "")
    verdict = verdict_of(small_document)
    assert verdict.word == "PASS"
    assert "ISO 14253-1: a figure passes if figure + U" in verdict.sentence
    assert "limits.toml" in verdict.sentence
    assert isinstance(small_document.opening[-1], Signature)
    assert small_document.opening[1] is verdict


def test_a_figure_above_or_near_its_limit_decides_the_run(small: PositioningReport) -> None:
    for limit, word in ((3.0, "FAIL"), (3.4, "NOT DECIDED")):
        assert limit - 0.3 < small.iso230_2.B
        limits = FigureLimits({"B": limit}, DecisionRule.ISO14253_1, {"B": 0.3}, "limits.toml")
        limited = replace(make_report(small.test, limits=limits), iso230_2=small.iso230_2)
        verdict = verdict_of(document_of(limited))
        assert verdict.word == word
        assert verdict.sentence.startswith("B: ")


def test_rounding_never_hides_on_which_side_of_its_limit_a_figure_is(
    small: PositioningReport,
) -> None:
    b = small.iso230_2.B
    limit = round(b, 2) if round(b, 2) < b else round(b, 2) + 0.0
    printed: list[str] = []
    for shifted in (limit - 1e-5, limit + 1e-5):
        result = replace(small.iso230_2, B=shifted)
        limits = FigureLimits({"B": limit}, DecisionRule.SIMPLE, {}, "limits.toml")
        report = replace(small, iso230_2=result, limits=check_limits(limits, result))
        printed.append(result_rows(document_of(report))[0][2])
    assert float(printed[0]) <= limit < float(printed[1])


def test_without_limits_there_is_no_verdict_and_a_note_says_so() -> None:
    document = document_of(make_report(make_run()))
    assert not any(isinstance(block, Verdict) for block in document.opening)
    assert "No limits were stated: this certificate gives no verdict." in notes_of(document)
    assert "The measurement uncertainty was not evaluated." in notes_of(document)
    assert all(len(row) == 3 for row in result_rows(document))


def test_the_names_follow_the_edition(small: PositioningReport) -> None:
    words: dict[str, str] = {}
    for edition in Edition:
        result = evaluate_iso230_2(small.test, edition=edition)
        document = document_of(replace(small, iso230_2=result))
        assert f"ISO 230-2:{edition}" in document.subtitle
        words[edition] = result_rows(document)[0][1]
        assert words[edition] == FIGURE_NAMES[edition]["B"]
    assert words[Edition.E2014] == "reversal error"
    assert words[Edition.E2006] == words[Edition.E1997] == "reversal value"


def test_a_unidirectional_run_says_why_figures_are_absent() -> None:
    document = document_of(make_report(make_run(approaches="forward")))
    rows = {row[0]: row for row in result_rows(document)}
    for symbol in ("B", "B̄", "M", "E↓", "E", "R↓", "R", "A↓", "A"):
        assert rows[symbol][2] == "absent"
        assert "measured forward only" in rows[symbol][1]
    for symbol in ("E↑", "R↑", "A↑"):
        assert float(rows[symbol][2]) > 0
    assert "Not evaluated: B, B̄, M, E↓, E, R↓, R, A↓, A (measured forward only)." in notes_of(
        document
    )
    annex = next(s for s in document.sections if s.heading.startswith("Annex A"))
    columns = next(b for b in annex.blocks if isinstance(b, Table)).columns
    assert [c.label for c in columns] == ["i", "Target [mm]", "x̄↑", "s↑", "R↑"]


def test_a_long_axis_says_why_repeatability_is_absent() -> None:
    report = make_report(make_run(12, 1, length=2750.0))
    rows = {row[0]: row for row in result_rows(document_of(report))}
    for symbol in ("R↑", "R↓", "R", "A↑", "A↓", "A"):
        assert rows[symbol][2] == "absent"
        assert "axis longer than 2000 mm" in rows[symbol][1]
    assert float(rows["E"][2]) > 0
    for words in ("results of each target", "adjacent-difference"):
        assert "absent" not in section_of(document_of(report), words)
    full = make_report(make_run(12, 3, length=2750.0), full=True)
    assert all(row[2] != "absent" for row in result_rows(document_of(full)))


def test_a_rotary_axis_is_certified_in_degrees_and_arcseconds() -> None:
    header = {"feed_deg_per_min": "720", "feed_mm_per_min": "300"}
    report = make_report(make_run(kind=AxisKind.ROTARY, length=360.0), header=header)
    document = document_of(report)
    table = next(b for b in document.opening if isinstance(b, Table))
    assert table.columns[1].label == "figure, values in arcsec"
    conditions = section_of(document, "Conditions")
    assert "('Feed', '720 °/min')" in conditions
    assert "mm/min" not in conditions
    assert "µm" not in section_of(document, "Annex")


def test_another_test_cycle_is_named_and_is_not_for_acceptance(small: PositioningReport) -> None:
    step, pilgrim = (replace(small.test, cycle=cycle) for cycle in (Cycle.STEP, Cycle.PILGRIM))
    for report, words in (
        (replace(small, test=step), "step cycle (Annex B)"),
        (make_report(pilgrim, limits=LIMITS), "pilgrim-step cycle"),
    ):
        document = document_of(report)
        assert f"9 targets, 5 runs per direction, {words}." in notes_of(document)
        assert "not for acceptance unless agreed" in notes_of(document)
        assert verdict_of(document).reservation == (
            "Test conditions of the standard not met: see the notes."
            " Not for acceptance unless agreed."
        )


def test_a_verdict_on_a_run_that_misses_a_condition_says_so(small: PositioningReport) -> None:
    assert verdict_of(document_of(small)).reservation == ""
    assert "does not meet" not in notes_of(document_of(small))
    report = make_report(make_run(cycles=8), limits=LIMITS)
    assert len(report.conditions) == 1
    document = document_of(report)
    assert verdict_of(document).reservation == (
        "Test conditions of the standard not met: see the notes."
    )
    assert sentence_of(report.conditions[0]) in notes_of(document)
    assert str(document.sections).count(sentence_of(report.conditions[0])) == 1


def test_the_number_of_runs_is_remarked_upon_only_where_the_standard_asks_for_another() -> None:
    words = "ISO 230-2 asks for 5 runs per direction; these figures are of"
    for usual in (make_run(), make_run(12, 1, length=2750.0)):
        assert words not in notes_of(document_of(make_report(usual, conditions=())))
    other = make_report(make_run(9, 7), conditions=())
    assert f"{words} 7." in notes_of(document_of(other))


def test_another_standard_carries_its_mark(small: PositioningReport) -> None:
    for other, heading in (
        (evaluate_vdi_dgq_3441(small.test), "Figures after VDI/DGQ 3441:1977"),
        (evaluate_iso230_2_1988(small.test), "Figures after ISO 230-2:1988"),
    ):
        text = section_of(document_of(replace(small, other_standard=other)), heading)
        assert "(unverified: from memory)" in text
        assert "Do not use these figures for acceptance" in text
        numbers = [
            v for k in type(other).__dataclass_fields__ if k != "mark" for v in [getattr(other, k)]
        ]
        assert all(f"'{value:.2f}'" in text for value in numbers)


def test_the_other_method_stands_apart_and_says_that_it_is_no_result_of_the_standard(
    small: PositioningReport, small_document: Document
) -> None:
    text = section_of(small_document, "adjacent-difference method")
    assert "not results of ISO 230-2 and do not replace them" in text
    assert "position 1 (0 mm) in cycle 1" in text
    assert "Student's factor t = 2.869" in text
    adjacent = small.adjacent_difference
    for values in (adjacent.forward.mean_difference, adjacent.forward.standard_uncertainty):
        assert all(f"'{value:.3f}'" in text for value in values)
    headings = [section.heading for section in small_document.sections]
    assert headings.index("Notes to the results") == 0
    assert [h for h in headings if h.startswith("Annex")] == [
        "Annex A: results of each target",
        "Annex B: adjacent-difference method (not results of ISO 230-2)",
        "Annex C: raw data (all readings)",
    ]


def test_a_short_run_does_not_claim_that_no_position_stands_out() -> None:
    for targets, cycles in ((4, 5), (9, 2)):
        text = section_of(document_of(make_report(make_run(targets, cycles))), "adjacent")
        assert "Too few positions or complete cycles" in text


def test_all_readings_are_printed_with_all_their_decimals() -> None:
    test = make_run(cycles=3)
    deviation = test.deviation.copy()
    deviation[4, 2, 0] = np.nan
    deviation[0, 0, 0] = -12.125
    report = make_report(replace(test, deviation=deviation))
    annex = document_of(report).sections[-1]
    tables = [block for block in annex.blocks if isinstance(block, Table)]
    cells = [cell for table in tables for row in table.rows for cell in row[2:]]
    assert len(cells) == deviation.size
    assert cells.count("missing") == 1
    assert "-12.125" in cells
    printed = sorted(float(cell) for cell in cells if cell != "missing")
    np.testing.assert_array_equal(printed, np.sort(deviation[~np.isnan(deviation)]))
    assert "53 readings, 1 missing" in str(annex.blocks[0])


def test_a_wide_run_is_printed_in_several_tables_that_hold_every_target() -> None:
    report = make_report(make_run(41, 2, length=1000.0))
    tables = [b for b in document_of(report).sections[-1].blocks if isinstance(b, Table)]
    assert len(tables) > 1
    labels = [column.label for table in tables for column in table.columns[2:]]
    assert [float(label) for label in labels] == report.test.target.tolist()


def test_targets_with_fewer_readings_are_counted_in_the_notes() -> None:
    test = make_run(9, 6, times=False)
    deviation = test.deviation.copy()
    deviation[4, 2:, 1] = np.nan
    deviation[:, 5] = np.nan
    report = make_report(replace(test, deviation=deviation), conditions=())
    assert "9 targets, 2 to 5 runs per direction, standard" in notes_of(document_of(report))
    assert "these figures are of 2 to 5." in notes_of(document_of(report))
    assert fields_of(report)["Runs per direction"] == "2 to 5"


def test_characters_without_a_sign_in_the_fonts_are_named(small: PositioningReport) -> None:
    latin = "Přejímka Größe µm Ελληνικά Кириллица ±½×→≤ naïve Łódź"
    assert unshowable(replace(small, header={"title": latin, "axis": "X"})) == ()
    header = {"title": "加工中心", "control": "中", "加": "1"}
    found = unshowable(replace(small, header=header, source_name="主.csv"))
    file = "name of the measurement file"
    assert found == (
        Message(
            "warning-not_in_pdf", {"count": 5, "names": f"Title, Control, further lines, {file}"}
        ),
        Message("warning-not_in_charts", {"count": 5, "names": f"Title, {file}"}),
    )
    report = replace(small, header=header)
    for warnings in ((), unshowable(report)):
        text = section_of(document_of(replace(report, warnings=warnings)), "Remarks")
        assert text.count("cannot be shown in the PDF") == 1


def test_a_stated_field_stands_beside_what_the_file_says_of_it(small: PositioningReport) -> None:
    test = replace(
        small.test,
        header={**small.test.header, "dwell": "2 s", "feed": "300 mm/min", "machine": "FNG 32"},
        environment={
            "air_temperature_c": StartEnd(23.6, 24.4),
            "expansion_coefficient_ppm_per_k": StartEnd(8.0, 8.0),
            "air_pressure_kpa": StartEnd(99.0, 99.0),
        },
    )
    stated = {
        "air_temperature_c": "19.8 to 20.1",
        "expansion_coefficient_ppm_per_k": "11.7",
        "air_pressure_kpa": "99",
        "dwell_s": "2.5",
        "feed_mm_per_min": "300.0",
        "machine": "FNG 32 B",
        "location": "hall 2",
    }
    report = replace(small, test=test, header={**test.header, **stated})
    fields = fields_of(report)
    assert fields["Air temperature"] == (
        "stated 19.8 to 20.1 °C; in the file 23.6 °C (start), 24.4 °C (end)"
    )
    assert fields["Expansion coefficient used"] == (
        "stated 11.7 ppm/K; in the file 8 ppm/K (start and end)"
    )
    assert fields["Air pressure"] == "99 kPa"
    assert fields["Dwell"] == "stated 2.5 s; in the file 2 s"
    assert fields["Feed"] == "300.0 mm/min"
    assert fields["Location"] == "hall 2"
    front = document_of(report).opening[0]
    assert isinstance(front, Fields)
    assert dict(front.fields)["Machine"] == "stated FNG 32 B; in the file FNG 32"
    document = document_of(replace(small, header={**small.header, "axis": "X1"}))
    assert document.title.endswith(", axis X1")
    assert "stated X1; in the file X" in section_of(document, "Conditions")


def test_the_duration_is_that_between_the_printed_start_and_end(small: PositioningReport) -> None:
    fields = fields_of(small)
    assert fields["Start"] == "2026-03-02 07:30:00 (zone not stated)"
    assert fields["Duration"] == "7 h 01 min 00 s"
    typed = {"start": "2026-03-02 08:00:00+01:00", "end": "2026-03-02 14:31:00+01:00"}
    fields = fields_of(replace(small, header={**small.header, **typed}))
    assert fields["Start"] == (
        "stated 2026-03-02 08:00:00+01:00; in the file 2026-03-02 07:30:00 (zone not stated)"
    )
    assert fields["End"] == "2026-03-02 14:31:00+01:00"
    assert fields["Duration"] == "stated 6 h 31 min 00 s; in the file 7 h 01 min 00 s"
    in_file = "7 h 01 min 00 s"
    before = f"stated none: the end lies before the start; in the file {in_file}"
    zones = {"start": "2026-03-02T07:30:00+01:00", "end": "2026-03-02T13:31:00Z"}
    for typed, printed in (
        ({"end": "2026-03-02 15:31:00"}, f"stated 8 h 01 min 00 s; in the file {in_file}"),
        ({"start": "in the morning"}, in_file),
        ({"end": "2026-03-01 08:00:00"}, before),
        (zones, in_file),
    ):
        fields = fields_of(replace(small, header={**small.header, **typed}))
        assert fields["Duration"] == printed


def test_a_run_that_the_instrument_reduced_to_20_c_says_by_what(small: PositioningReport) -> None:
    assert "Applied by (instrument or software)" not in fields_of(small)
    words = "yes, with 8 ppm/K (environment factor)"
    test = replace(small.test, header={**small.test.header, "normalised_to_20_c": words})
    report = replace(small, test=test, header=test.header)
    fields = fields_of(report)
    assert fields["Correction of nominal expansion (NDE)"] == words
    applied = fields["Applied by (instrument or software)"]
    assert applied.startswith("instrument: the deviations are already reduced to 20 °C")
    assert "environment factor" in applied
    assert "normalised to 20 c" not in fields
    typed = {**test.header, "nde_correction": "no", "nde_applied_by": "instrument"}
    fields = fields_of(replace(report, header=typed))
    assert fields["Correction of nominal expansion (NDE)"] == f"stated no; in the file {words}"
    assert fields["Applied by (instrument or software)"] == applied


def test_what_nobody_stated_is_left_out_and_makes_a_draft() -> None:
    readings = np.array([[[0.1, 0.2], [0.3, 0.1]], [[0.5, 0.4], [0.2, 0.1]]])
    test = PositioningTest(kind=AxisKind.LINEAR, target=np.array([0.0, 10.0]), deviation=readings)
    document = document_of(make_report(test))
    section = next(s for s in document.sections if s.heading.startswith("Conditions"))
    fields = [b for b in section.blocks if isinstance(b, Fields)]
    stated = {label for group in fields for label, _ in group.fields}
    assert stated == {
        *("Targets", "Runs per direction", "Kind of cycle", "Directions", "Source of the times"),
        *("Measurement file", "SHA-256 of the measurement file", "Software"),
        *("Options of reading and evaluation", "SHA-256 of the results (results.json)"),
    }
    assert document.date is None
    assert "not stated" not in f"{document.opening} {section}"
    assert document.subtitle.endswith(", draft")
    assert document.footer.startswith("Draft · ")
    assert all(one in str(document.opening) for one in ("Certificate number", "Date of the run"))


def test_options_are_stated_and_part_of_the_results(small: PositioningReport) -> None:
    column = {"Hin <2>": {"cycle": 2, "direction": "forward"}}
    read = replace(small, options={"decimal": "comma", "reference_time_h": 0.0, "columns": column})
    stated = section_of(document_of(read), "Conditions")
    assert "decimal comma; reference time h 0.0; columns" in stated
    assert "Hin <2>" in stated
    assert "'defaults'" in section_of(document_of(small), "Conditions")
    assert json.loads(results_json(read))["options"] == read.options
    assert results_sha256(read) != results_sha256(small)


def test_days_of_test_and_issue_stand_on_the_first_page(
    small: PositioningReport,
) -> None:
    dated = replace(small, date="2026-11-20")
    untimed = replace(small, test=replace(small.test, start=None, end=None))
    typed = replace(small, header={**small.header, "end": "2026-03-04"})
    issued = replace(small, header={**small.header, "date_of_issue": "2026-03-09"})
    test, issue = ("Date of the test", "2026-03-02"), "Date of issue"
    for report, rows, of_the_file in (
        (small, [test], "2026-03-02"),
        (dated, [(issue, "2026-11-20"), test], "2026-11-20"),
        (issued, [(issue, "2026-03-09"), test], "2026-03-09"),
        (replace(issued, date="2026-11-20"), [(issue, "2026-11-20"), test], "2026-11-20"),
        (untimed, [], None),
        (typed, [("Date of the test", "2026-03-02 to 2026-03-04")], "2026-03-04"),
    ):
        document = document_of(report)
        front = document.opening[0]
        assert isinstance(front, Fields)
        assert [field for field in front.fields if field[0].startswith("Date")] == rows
        assert document.date == of_the_file
    with pytest.raises(ConfigurationError, match="not a date"):
        replace(small, date="20.11.2026")


ACCREDITED = {
    "certificate_number": "2026-0417",
    "authorised_by": "A. B.",
    "authorised_as": "head of the laboratory",
    "laboratory": "laboratory for machine tools",
    "laboratory_address": "Example Street 1",
    "laboratory_country": "SK",
    "laboratory_mark": "K 000",
    "performed_at": "customer",
    "machine": "FNG 32",
    "serial_number": "32-0417",
    "customer": "school of engineering",
    "customer_address": "Example Square 2",
    "instrument": "XL-80",
    "instrument_certificate_number": "5012-25",
    "instrument_traceability": "the metre",
    "air_temperature_sensor": "Pt100 No. 17",
}


def test_a_laboratory_its_number_and_what_it_states_stand_on_the_certificate(
    small: PositioningReport,
) -> None:
    report = replace(small, header={**small.header, **ACCREDITED})
    document = document_of(report)
    assert report.missing_fields == ()
    assert document.issuer == (
        "laboratory for machine tools",
        "Example Street 1 · SK · mark K 000",
    )
    assert document.footer.startswith("Certificate 2026-0417 · ")
    assert "draft" not in f"{document.subtitle} {document.opening}".lower()
    front = dict(document.opening[0].fields)
    assert front["Certificate number"] == "2026-0417"
    assert front["Customer"] == "school of engineering · Example Square 2"
    assert front["Instrument's certificate"] == "5012-25 · the metre"
    *_, said, signature = document.opening
    assert "relate only to the item tested" in said.text
    assert "only in full, unless laboratory for machine tools agrees in writing" in said.text
    assert signature.labels[1] == "Authorised by A. B., head of the laboratory"
    assert fields_of(report)["Air temperature"]
    assert document.end == "End of the certificate."
    own = replace(report, header={**report.header, "reproduction": "Ask us."})
    assert document_of(own).opening[-2].text.endswith(" Ask us.")


def test_each_needed_field_alone_makes_a_draft(small: PositioningReport) -> None:
    needed = [field for field in HEADER_FIELDS.values() if field.needed]
    assert len(needed) == 10
    whole = {**small.header, **ACCREDITED}
    for field in needed:
        header = {key: text for key, text in whole.items() if key != field.key}
        assert replace(small, header=header).missing_fields == (field.place,)
    test = replace(small.test, start=None, end=None)
    for header, missing in ((whole, ("time.date",)), ({**whole, "date": "2026-03-02"}, ())):
        assert replace(small, test=test, header=header).missing_fields == missing


def test_the_hash_of_the_results_follows_the_results_alone(small: PositioningReport) -> None:
    content = json.loads(results_json(small))
    assert content == as_json(describe_evaluation(small))
    assert hashlib.sha256(results_json(small)).hexdigest() == results_sha256(small)
    assert results_sha256(replace(small, date="2026-11-20")) == results_sha256(small)
    other = replace(small, iso230_2=replace(small.iso230_2, B=small.iso230_2.B + 1e-9))
    assert results_sha256(other) != results_sha256(small)
    document = document_of(small)
    assert results_sha256(small) in section_of(document, "Conditions")
