"""The guide and the report: complete for every target, in safe words, the same on every day."""

import json
import math
import re
from dataclasses import replace
from hashlib import sha256

import pytest

from thermaxis.codes import message_as_json
from thermaxis.compensation import (
    Compensation,
    CompensationModel,
    Limits,
    Output,
    Part,
    Provenance,
    Section,
    SensorRules,
    SupervisorRules,
)
from thermaxis.plc import (
    Block,
    GuideFacts,
    LineSettings,
    PlcSettings,
    ReportFacts,
    Target,
    export_settings,
    guide_text,
    remark_of,
    report_of,
    report_text,
)

TARGETS = [
    *(Target("scl", "s7-1500"), Target("scl", "s7-300"), Target("c")),
    *(Target("st", flavour) for flavour in ("iec", "twincat", "codesys")),
]
HOSTILE = "*) END_VAR | `x` <script> \n# {0} ä"


def exported(*, double: bool = True, delay_s: float = 0.0) -> PlcSettings:
    part = Part(
        f"part {HOSTILE}",
        f"T {HOSTILE}",
        "T2",
        1.0,
        (Section(2.0, 100.0), Section(3.0, 36_000.0)),
        delay_s=delay_s,
    )
    model = CompensationModel(
        outputs=(Output(f"Z {HOSTILE}", (part,)),),
        provenance=Provenance(method=HOSTILE, date=HOSTILE),
        warnings=(HOSTILE,),
    )
    compensation = Compensation(
        model=model,
        sensors=dict.fromkeys(model.channels, SensorRules(lowest_c=1.0, highest_c=90.0)),
        limits={output.name: Limits(50.0, 0.25) for output in model.outputs},
    )
    return export_settings(compensation, cycle_s=1.0, name="z", double=double)


def flowing(text: str) -> str:
    """Return a text in one line: where its lines are broken does not matter."""
    return " ".join(text.split())


def guide(settings: PlcSettings, target: Target) -> str:
    facts = GuideFacts(target, ("tx_z.x",), "tx_z.vectors.csv", (HOSTILE, "referenced"))
    return guide_text(settings, Block(settings=settings), facts)


@pytest.mark.parametrize("target", TARGETS, ids=str)
def test_the_guide_has_every_input_and_output_safe_words_and_no_mark_unexplained(
    target: Target,
) -> None:
    settings = exported(double=target.variant != "s7-300")
    text = guide(settings, target)
    face = Block(settings=settings).interface
    for variable in (*face.inputs, *face.outputs, *face.identity):
        rows = [row for row in text.splitlines() if row.startswith(f"| `{variable.name}` |")]
        assert len(rows) == 1, variable.name
        assert variable.text in rows[0]
    for heading in ("1. Import", "2. Call", "5. Check the numbers", "7. Switch off"):
        assert f"\n## {heading}" in text
    assert "\n## Not protected\n" in text
    assert "within 200 s from the largest one" in flowing(text)  # 50 um at 0.25 um/s
    assert ("TIA Portal not checked" in text) == (target.dialect == "scl")
    # Text from people comes as letters, digits and few signs.
    assert text.isascii()
    for piece in ("*)", "<script>", "{0}", "`x`", "END_VAR |"):
        assert piece not in text
    assert "END_VAR x script 0 a" in text
    # Every mark that is used is explained.
    used = set(re.findall(r"\[(run|V|inf|trade|M|src|S)[,\] ]", text))
    legend = text.partition("\nMarks:")[2].partition("\n\n")[0]
    assert used
    assert {mark for mark in used if f"[{mark}]" not in legend} == set()


def test_the_side_of_the_control_names_every_setting_data_and_the_sign() -> None:
    settings = exported()
    outputs = tuple(
        Output(name, settings.compensation.model.outputs[0].parts) for name in ("at_0", "at_800")
    )
    model = CompensationModel(outputs=outputs)
    compensation = Compensation(
        model=model,
        sensors=dict.fromkeys(model.channels, SensorRules(lowest_c=1.0, highest_c=90.0)),
        limits={output.name: Limits(50.0, 0.25) for output in outputs},
    )
    settings = export_settings(compensation, cycle_s=1.0, name="x", double=True)
    for away, sign in ((True, "K = -0.001 mm"), (False, "K = +0.001 mm")):
        line = LineSettings(positions_mm=(0.0, 800.0), away=away)
        target = Target("sinumerik-tempcomp", "s7-1500")
        facts = GuideFacts(target, ("tx_x.scl",), "tx_x.vectors.csv", (), line)
        text = flowing(guide_text(settings, Block(settings=settings, line=line), facts))
        for word in ("SD43900", "SD43910", "SD43920", "MD32750", "MD32760", "FB3", "FB2"):
            assert word in text
        assert sign in text
        assert "**Not verified:**" in text
        assert "**the same trim at every position**" in text
        trim_um = settings.compensation.bounds[0].largest_trim_um
        assert f"at most {trim_um:g} um, which is the largest" in text
        assert "10 um" not in text
        assert "**and reference position** of the same call belong into one PUT job" in text
        assert "| mm | 400, constant |" in text
        report = report_of(settings, ReportFacts(target, (), line), {})
        assert report["line"] == {
            "positions_mm": [0.0, 800.0],
            "reference_mm": 400.0,
            "positive_motion": "away" if away else "towards",
            "largest_k0_mm": pytest.approx(0.05, rel=2e-6),
            "largest_slope": pytest.approx(0.1 / 800.0, rel=2e-6),
            "velocity_factor": 0.01,
        }


def test_the_table_of_losses_has_the_numbers_of_the_export() -> None:
    settings = exported()
    rules = SupervisorRules(
        settle_s=61.0,
        recovery_delay_s=3.5,
        input_timeout_s=2.5,
        hold_input_s=310.0,
        hold_connection_s=320.0,
        hold_interlock_s=7.0,
        hold_operator_s=3700.0,
        at_limit_s=640.0,
        read_back_tolerance_um=0.75,
        read_back_s=11.0,
        longest_trim_s=28_888.0,
    )
    sensor = SensorRules(
        lowest_c=1.5, highest_c=91.0, largest_rate_k_per_s=0.12, step_k=1.25, frozen_s=14_404.0
    )
    compensation = replace(
        settings.compensation,
        supervisor=rules,
        sensors=dict.fromkeys(settings.compensation.model.channels, sensor),
        model=replace(settings.compensation.model, longest_hold_s=177.0),
    )
    changed = replace(settings, compensation=compensation)
    text = guide(changed, Target("c"))
    table = text.partition("## What is lost, and what follows")[2].partition("## Not protected")[0]
    for number in ("3.5 s", "2.5 s", "177 s", "320 s", "7 s", "3700 s", "640 s", "0.75 um", "11 s",
                   "28888 s", "61 s", "0.25 um/s", "0.25 um in one call"):  # fmt: skip
        assert number in table, number
    assert "Fading after 312.5 s in all" in table  # bridged and held
    assert "| 1.5 to 91 | 1.25 | 0.12 | 14404 |" in table
    assert "at most 200 s to zero" in table  # 50 um at 0.25 um/s
    assert "one count of that sensor, is carried until the next restart" in table
    assert len({row.count("|") for row in table.splitlines() if row.startswith("| a ")}) == 1
    assert "are over in its first call" not in table
    slow = export_settings(compensation, cycle_s=10.0, name="z")
    assert "the 2.5 s that bridge a lost temperature are over in its first call" in guide(
        slow, Target("c")
    )


def test_what_a_call_may_move_is_in_guide_and_head_and_a_large_step_is_warned_of() -> None:
    for cycle_s, step_um in ((1.0, "0.25"), (40.0, "10"), (48.0, "12")):
        settings = export_settings(exported().compensation, cycle_s=cycle_s, name="z")
        said = flowing(guide(settings, Target("c")))
        head = Block(settings=settings).c()["tx_z.h"].partition("#ifndef")[0]
        assert f"at most {step_um} um in one call" in said
        for text in (said, " ".join(head.replace("*/\n/*", "").split())):
            assert ("may move by 12 um in one call" in text) == (cycle_s == 48.0)
        assert f"a step of at most {step_um} um **from what was just read" in said


def test_a_model_without_a_gain_is_said_never_to_correct_and_no_hours_of_zero_are_named() -> None:
    settings = exported()
    model = settings.compensation.model
    parts = model.outputs[0].parts
    none = (replace(parts[0], direct_gain_um_per_k=0.0, sections=(Section(0.0, 900.0),)),)
    direct = (replace(parts[0], sections=()),)
    for changed, warned, hours in ((none, True, False), (direct, False, False), (parts, False, 1)):
        outputs = (replace(model.outputs[0], parts=changed),)
        compensation = replace(settings.compensation, model=replace(model, outputs=outputs))
        text = guide(replace(settings, compensation=compensation), Target("c"))
        assert ("never corrects: all its gains are zero" in text) == warned
        assert ("wrong for about three of its slowest time constants" in text) == hours
        assert " 0 h" not in text


def test_a_range_that_an_open_input_lies_in_is_warned_of() -> None:
    for lowest_c, warned in [(-10.0, True), (0.0, True), (0.5, False)]:
        settings = exported()
        rules = dict(settings.compensation.sensors)
        rules["T2"] = SensorRules(lowest_c=lowest_c, highest_c=90.0)
        changed = replace(settings, compensation=replace(settings.compensation, sensors=rules))
        text = guide(changed, Target("c"))
        assert ("0.0 degC lies in the plausible range of T2: an open input" in text) == warned
        assert "what the lowest or highest count of its module means" in text


def test_the_report_states_the_law_of_the_stall_of_every_section() -> None:
    for double, half_unit in ((True, 2.0**-53), (False, 2.0**-24)):
        facts = ReportFacts(Target("scl", "s7-1500"), (("z.json", "0" * 64),), None)
        report = json.loads(report_text(report_of(exported(double=double), facts, {})))
        sections = report["arithmetic"]["sections"]
        assert [s["time_constant_s"] for s in sections] == [100.0, 36_000.0]
        for section in sections:
            share = 1.0 - math.exp(-1.0 / section["time_constant_s"])
            assert section["alpha"] == pytest.approx(share, rel=1e-9)
            assert section["rest_share_uncompensated"] == pytest.approx(half_unit / share, rel=1e-9)
        if not double:  # the reference's table: 10 h at 1 s rests 0.17 % of the step too early
            assert sections[1]["rest_share_uncompensated"] == pytest.approx(0.002, rel=0.1)
            assert sections[1]["rest_share"] < 1e-9


def test_a_section_in_binary32_rests_no_further_from_its_end_than_the_law_says() -> None:
    import numpy as np  # noqa: PLC0415  of this test only

    alpha = np.float32(-math.expm1(-1.0 / 3600.0))
    x, end = np.float32(0.0), np.float32(10.0)
    for _ in range(60 * 3600):
        before, x = x, np.float32(x + np.float32(alpha * np.float32(end - x)))
        if x == before:
            break
    facts = ReportFacts(Target("scl", "s7-300"), (), None)
    settings = exported(double=False)
    found = report_of(settings, facts, {})["arithmetic"]
    assert isinstance(found, dict)
    at_100_s = found["sections"][0]
    law = at_100_s["rest_share_uncompensated"] * at_100_s["alpha"] / float(alpha)
    rest = (float(end) - float(x)) / 10.0
    # ulp(10) / (2 * 10) lies between half and the whole of 2**-24.
    assert 0.5 * law <= rest <= law


def test_the_report_has_hashes_of_the_files_and_no_day() -> None:
    facts = ReportFacts(Target("c"), (("z.json", "ab" * 32),))
    files = {"tx_z.c": b"text\n", "tx_z.h": "µ\n".encode()}
    settings = exported(double=False, delay_s=2.4)
    report = report_of(settings, facts, files)
    assert report["files"] == {n: sha256(t).hexdigest() for n, t in files.items()}
    assert report["models"] == [{"name": "z.json", "sha256": "ab" * 32}]
    assert report["changed"] == [*map(remark_of, settings.notes)]
    assert report["changed_codes"] == [*map(message_as_json, settings.notes)]
    assert len(settings.notes) == 1
    assert report == report_of(settings, facts, files)
    text = report_text(report)
    assert text.isascii()
    assert re.search(r"20[0-9]{2}-[0-9]{2}-[0-9]{2}", text) is None


def test_a_unit_and_a_program_in_c_are_not_told_of_a_plc_and_every_file_is_imported() -> None:
    for target in (Target("fmu", "fmu"), Target("c")):
        assert "PLC" not in guide(exported(), target)
    for target in TARGETS:
        assert "both files" not in guide(exported(double=target.variant != "s7-300"), target)
