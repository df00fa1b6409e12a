"""docs/json.md names every key of the JSON, and the JSON has every key that it names."""

import asyncio
import json
import math
import re
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from shutil import copytree

import numpy as np
import pytest

from tests.unit.fleet.fleet_machines import GAIN, LAST, Truth, model_of, shipped
from tests.unit.runtime.machine_files import machine_file
from thermaxis.cli import main
from thermaxis.cli.machine.commission import _record
from thermaxis.cli.machine.relearn import _described
from thermaxis.codes import Message
from thermaxis.compensation import Output, Part
from thermaxis.files import write_model, write_tidy_csv
from thermaxis.positioning import FIGURE_KEYS
from thermaxis.report.tables import as_json
from thermaxis.runtime import EventRecord, StepProof, SystemClock, read_machine
from thermaxis.runtime.history import HistorianSettings, SqlHistorian
from thermaxis.thermal import Candidate, Comparison, Proposal, RelearnedOutput
from thermaxis.virtual import paper_x_axis

pytestmark = pytest.mark.usefixtures("one_clock_and_regime")

PROMISED = {
    "test": "targets cycles unidirectional kind start end header environment time_source",
    "iso230_2": "edition B B_mean M E_forward E_backward E R_forward R_backward R"
    " A_forward A_backward A targets",
    "iso230_2.targets[]": "position mean_forward mean_backward mean s_forward s_backward"
    " B R_forward R_backward R",
    "adjacent_difference": "reference_cycle student_factor forward backward",
    "adjacent_difference.forward": "mean_difference standard_uncertainty standard_deviation"
    " s_ratio chart bound anomalies",
    "adjacent_difference.forward.anomalies[]": "position position_mm statistic",
    "Top level": "test iso230_2 adjacent_difference drift warnings version",
    "drift": "model significant p_no_drift noise_std_forward noise_std_backward residual_std"
    " total total_per_m reference_time_s levels_forward levels_backward levels_std_forward"
    " levels_std_backward iso230_2 uncertainty diagnosis",
    "drift.diagnosis[]": "finding value unit text message",
    "figures": " ".join(FIGURE_KEYS),
    "identify": "method stable outputs warnings",
    "identify.outputs.NAME": "fit_percent parts noise_std_um warnings numerator denominator"
    " sample_time_s",
    "identify.outputs.NAME.parts[]": "input direct_gain gains time_constants_s std dc_gain"
    " dc_gain_std flags",
    "verify": "outputs logs",
    "verify.outputs.NAME": "fit_percent peak_to_peak_um rmse_um mae_um max_um"
    " persistence_rmse_um static_rmse_um",
    "verify.outputs.NAME.peak_to_peak_um": "uncompensated residual reduction",
}
FREE = (
    "thermal-test-evaluate.cases[].quantities[].whole.standard_uncertainties",
    *("thermal-test-plan.steps[].levels", "thermal-test-plan.settled_um"),
    "thermal-test-places.without_um",
    *("options", "test.header", "test.environment", "plan.plan", "plan.search.tried"),
    *(f"identify.outputs.NAME.{key}" for key in ("numerator", "denominator")),
    *("identify.joint_gains.gains", "verify.logs[].outputs.NAME.contribution_peak_to_peak_um"),
    *("model.reference_c", "model.provenance.figures"),
    *("correct.options", "check-table.options", "events.events[].details"),
    "check.configuration[].place",
    "check.configuration[].values",
    "identify.findings[].values",
    "machine.channels",
    "drift.diagnosis[].message",
    "machine.axes[].runs[].findings[].message",
)
"""Objects whose keys come from a file, are numbers of cycles, options of one control, or those of
what is said as data."""

CODES = ("_code", "_codes[]")
"""Ends of the keys of what is said as code, values and place."""

BY_FIGURE = ("plan.expected.figures",)
"""Objects with one object for each figure."""

BY_NAME = (
    "show.nights[].outputs",
    *("identify.outputs", "verify.outputs", "verify.touches", "compare.models[].outputs"),
    *("verify.logs[].outputs", "verify.logs[].outside_training_range"),
    *(f"check.machine.{key}" for key in ("inputs", "interlocks", "probes", "outputs")),
)
"""Objects with one object for each name that a user gave."""

VERIFIED = "verify.outputs.NAME"
TESTED = "thermal-test-evaluate.cases[].quantities[]"
PAIRS = ("peak_to_peak_um", "after_60_min_um", "at_end_um")
SAME_KEYS = {
    "compare.models[].outputs.NAME": VERIFIED,
    **{f"verify.logs[].outputs.NAME.{key}": f"{VERIFIED}.{key}" for key in PAIRS},
    "adjacent_difference.backward": "adjacent_difference.forward",
    "drift.iso230_2": "iso230_2",
    "uncertainty.drift_free": "uncertainty.measured",
    "field.drift.correlation_slope": "field.drift.correlation_common",
    **dict.fromkeys(
        (
            "drift.uncertainty",
            "uncertainty.measured.expanded_uncertainty",
            "uncertainty.measured.bias",
            "uncertainty.measured.corrected_standard_uncertainty",
            "uncertainty.measured.coverage_factor",
            "uncertainty.drift_effect",
            "trend.runs[].iso230_2",
            "trend.runs[].uncertainty",
            "trend.runs[].drift.iso230_2",
            "trend.runs[].drift.uncertainty",
            *(
                f"machine.axes[].runs[].{part}{key}"
                for part in ("", "drift.")
                for key in ("iso230_2", "uncertainty")
            ),
        ),
        "figures",
    ),
    **dict.fromkeys(
        (
            *(f"correct.figures.{when}" for when in ("before", "after")),
            *(f"correct.figures_without_drift.{when}" for when in ("before", "after")),
            *(f"check-table.figures.{when}" for when in ("before", "after", "opposite_sign")),
            *(f"check-table.figures_without_drift.{when}" for when in ("before", "after")),
        ),
        "figures",
    ),
    "identify.outputs.NAME.peak_to_peak_um": f"{VERIFIED}.peak_to_peak_um",
    **{f"{TESTED}.{part}": f"{TESTED}.whole" for part in ("first_hour", "cooling")},
    "channels.findings": "identify.findings",
    "check.warnings": "check.configuration",
    "machine.nights": "show.nights",
    "show.nights[].touched[].before": "show.nights[].touched[].day",
    "check.self_test": "check.configuration",
    "correct.input": "input",
    "check-table.input": "input",
    "correct.figures_without_drift": "correct.figures",
    "check-table.figures_without_drift": "correct.figures",
    "check-table.table": "correct.table",
    "check-table.targets": "correct.targets",
    **dict.fromkeys(
        (f"montecarlo.{name}" for name in ("two_sequences", "to_larger", "to_smaller")),
        "montecarlo.one_sequence",
    ),
}
"""Objects with the keys of another one, which the page describes once."""


@pytest.fixture(scope="module")
def documented(root: Path) -> dict[str, set[str]]:
    page = (root / "docs" / "json.md").read_text(encoding="utf-8")
    parts = re.split(r"^## (.*)$", page, flags=re.MULTILINE)
    return {
        title.strip("` "): set(re.findall(r"^\| `([^`]+)`", body, re.MULTILINE))
        for title, body in zip(parts[1::2], parts[2::2], strict=True)
    }


def test_every_promised_key_is_documented(documented):
    lost = {place: set(keys.split()) - documented[place] for place, keys in PROMISED.items()}
    assert {place: keys for place, keys in lost.items() if keys} == {}


def keys_by_place(value: object, place: str, found: dict[str, set[str]]) -> None:
    if isinstance(value, dict) and place not in FREE and not place.endswith(CODES):
        if place not in (*BY_FIGURE, *BY_NAME):
            found.setdefault(place or "Top level", set()).update(value)
        for key, part in value.items():
            if place in BY_FIGURE:
                assert key in FIGURE_KEYS
                keys_by_place(part, f"{place}.KEY", found)
                continue
            if place in BY_NAME:
                keys_by_place(part, SAME_KEYS.get(f"{place}.NAME", f"{place}.NAME"), found)
                continue
            same = SAME_KEYS.get(f"{place}.{key}", f"{place}.{key}" if place else key)
            keys_by_place(part, same, found)
    elif isinstance(value, list):
        for part in value:
            keys_by_place(part, f"{place}[]", found)


def keys_written(
    words: list[str], place: str, found: dict[str, set[str]], *, code: int = 0
) -> dict[str, object]:
    """Run a command, collect the keys of its JSON, and return it."""
    destination = Path(words[words.index("--json") + 1])
    assert main(words) == code
    result: dict[str, object] = json.loads(destination.read_text(encoding="ascii"))
    keys_by_place(result, place, found)
    return result


def write_run(path: Path, seed: int) -> None:
    """Write a run with a position that scatters more, a drift, a step and an outlier."""
    rng = np.random.default_rng(seed)
    readings = rng.normal(0.0, 0.3, (8, 40, 2))
    readings[3] *= 6.0
    readings[5, 7, 0] += 30.0
    lines = ["cycle,direction,target_mm,deviation_um,time_s"]
    for j in range(40):
        for a, word in enumerate(("forward", "backward")):
            for i in range(8) if a == 0 else range(7, -1, -1):
                time_s = 10.0 * (16 * j + (i if a == 0 else 15 - i))
                drift = 5.0 * np.tanh(time_s / 3000.0) + 4.0 * (time_s > 4000.0)
                deviation = readings[i, j, a] + drift
                lines.append(f"{j + 1},{word},{20 * i},{deviation:.3f},{time_s:g}")
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


@pytest.fixture(scope="module")
def evaluated(
    tmp_path_factory: pytest.TempPathFactory,
    fitted_once: Callable[[], AbstractContextManager[None]],
) -> Iterator[tuple[Path, dict[str, object]]]:
    """Evaluate a run with an anomaly, a drift and an outlier, and return file and JSON."""
    folder = tmp_path_factory.mktemp("json")
    run = folder / "run.csv"
    write_run(run, seed=5)
    limits = folder / "limits.toml"
    limits.write_text("[limits]\nA_um = 12.0\nM_um = 4.0\n", encoding="utf-8")
    words = ["evaluate", str(run), "--limits", str(limits)]
    with fitted_once():
        yield run, keys_written([*words, "--json", str(folder / "r.json")], "", {})


@pytest.fixture(scope="module")
def written(evaluated: tuple[Path, dict[str, object]], root: Path) -> dict[str, set[str]]:
    """Collect the keys of every command that writes JSON."""
    run, result = evaluated
    folder = run.parent
    found: dict[str, set[str]] = {}
    keys_by_place(result, "", found)
    json_words = ["--json", str(folder / "more.json")]
    for edition in ("1988", "vdi3441"):
        keys_written(["evaluate", str(run), "--edition", edition, *json_words], "", found)
    for options in ((), ("--sigma-b", "2")):
        words = ["montecarlo", "--repetitions", "40", *options, *json_words]
        keys_written(words, "montecarlo", found)
    words = ["plan", "--length", "300", "--targets", "8", "--target-uncertainty", "0.3"]
    keys_written([*words, *json_words], "plan", found)
    keys_written(["trend", str(run), str(run), *json_words], "trend", found)
    table = str(folder / "table")
    words = [str(run), "--control", "sinumerik", "--backlash", "--axis", "X"]
    keys_written(["correct", *words, "-o", table, *json_words], "correct", found)
    merged = ["--merge", table, "-o", str(folder / "merged")]
    keys_written(["correct", *words, *merged, *json_words], "correct", found)
    words = ["check-table", table, str(run), "--control", "sinumerik", *json_words]
    keys_written(words, "check-table", found)
    before, after = (str(root / "examples" / f"field_{when}.csv") for when in ("before", "after"))
    words = ["field", before, before, after, "--run", str(run), "--times", "0", "1", "1.7"]
    keys_written([*words, *json_words], "field", found)
    write_thermal(root / "examples", folder, found)
    write_machine(root / "examples" / "machine", folder, found)
    write_fleet(folder, found)
    return found


async def remembered(path: Path) -> None:
    clock = SystemClock()
    historian = SqlHistorian(HistorianSettings(url=f"sqlite:///{path}"), clock)
    await historian.open(("Z_um",))
    historian.event(EventRecord(clock.utc(), "request", "novak", "enable was accepted"))
    await historian.close(10.0)


def write_machine(example: Path, folder: Path, found: dict[str, set[str]]) -> None:
    """Collect the keys of the commands at the machine; there is no machine."""
    path = Path(copytree(example, folder / "machine")) / "lathe.toml"
    json_words = ["--json", str(folder / "machine.json")]
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace("127.0.0.1:4840", "127.0.0.1:1"), encoding="utf-8")
    looked = ["check", str(path), "--wait", "0.2", *json_words]
    result = keys_written(looked, "check", found, code=1)
    assert result["warnings"]
    assert result["self_test"]
    asyncio.run(remembered(folder / "machine" / "lathe.history.db"))
    result = keys_written(["history", "events", str(path), *json_words], "events", found)
    assert result["events"]
    (folder / "lake").mkdir()
    words = ["history", "ship", str(path), str(folder / "lake"), *json_words]
    keys_written(words, "ship", found)
    path.write_text(text.replace("largest_um", "largest"), encoding="utf-8")
    keys_written(["check", str(path), *json_words], "check", found, code=2)
    proof = StepProof("Z_um", 10.0, 0.0, 10.0, None, 10.1, 0.1, Message("event-step_proven"))
    keys_by_place(_record(proof, touches=True), "commission", found)
    times = (datetime(2026, 11, day, tzinfo=UTC) for day in (9, 21, 23))
    output = Output("Z_um", (Part("spindle", "T_spindle_C"),))
    one = Candidate(output, None, Comparison(1.0, 0.5, 1.5, 1.2, 30), (2.0, 1.5), True)
    told = RelearnedOutput("Z_um", (300, 60), (one,), one, Message("relearn-better"))
    machine = read_machine(example / "lathe.toml")
    relearnt = _described(machine, Proposal(None, (told,)), ("", None), tuple(times), [])
    keys_by_place(as_json([*relearnt]), "relearn", found)


def write_fleet(folder: Path, found: dict[str, set[str]]) -> None:
    """Collect the keys of the commands of a fleet of two machines."""
    (folder / "fleet").mkdir()
    model, registry = str(folder / "a.json"), str(folder / "registry.db")
    write_model(model_of(1.3 * GAIN), model)
    assert main(["fleet", "init", registry, str(folder / "fleet")]) == 0
    for name, truth in (("A", Truth()), ("B", Truth(2, frozen=True))):
        shipped(folder, folder / "fleet", name, truth)
        assert main(["fleet", "add", registry, name, model]) == 0
    json_words = ["--json", str(folder / "fleet.json")]
    night = ["fleet", "night", registry, "--day", LAST.isoformat(), *json_words]
    keys_written([*night, "--dry-run"], "night", found)
    keys_written(night, "night", found)
    assert keys_written(["fleet", "show", registry, *json_words], "show", found)["nights"]
    runs = [str(folder / f"{year}.csv") for year in (2024, 2025, 2026)]
    for year, path in enumerate(runs, start=2024):
        measured = paper_x_axis(year, cycles=5).test
        start = datetime(year, 11, 23, tzinfo=UTC)
        write_tidy_csv(replace(measured, start=start, end=None), path)
    words = ["fleet", "collect", registry, *runs, "--machine", "A", *json_words]
    keys_written(words, "collect", found)
    keys_written(["fleet", "machine", registry, "A", *json_words], "machine", found)
    (folder / "fetching").mkdir()
    machine = machine_file(folder / "fetching")
    own = str(machine.parent / "models" / "lathe.json")
    assert main(["fleet", "add", registry, "vertical lathe", own]) == 0
    keys_written(["fleet", "fetch", str(machine), registry, *json_words], "fetch", found)


def write_thermal(examples: Path, folder: Path, found: dict[str, set[str]]) -> None:
    """Collect the keys of the commands of thermal compensation, and of their model."""
    tests = [str(examples / f"lathe_{name}.csv") for name in ("spindle", "table")]
    parts = ["--input", "spindle=T_spindle_C-T_column_C", "--input", "table=T_table_C-T_column_C"]
    json_words = ["--json", str(folder / "thermal.json")]
    model = str(folder / "model.json")
    rows = [
        f"{600 * k},{22 + 0.5 * math.sin(k / 23):.1f},{22 + math.sin(k / 23) + 0.1 * (k % 2):.1f}"
        for k in range(400)
    ]
    coarse = folder / "coarse.csv"
    coarse.write_text("\n".join(["time_s,T_column_C,T_air_C", *rows]), encoding="ascii")
    keys_written(["channels", str(coarse), *tests, *json_words], "channels", found)
    joined = str(folder / "joined.csv")
    keys_written(["merge", *tests, "-o", joined, *json_words], "merge", found)
    identify = ["identify", *tests, "--output", "Z_um", "--sample-time", "120", *json_words]
    keys_written([*identify, "--candidates", "T*_C"], "identify", found)
    for words in (
        ["--method", "oe", "--orders", "1,1,0"],
        ["--method", "arx", "--orders", "1,2,0"],
    ):
        keys_written([*identify, *parts, *words], "identify", found)
    joint = ["--joint", "table=Z_D0_um@0,Z_D3000_um@3000"]
    keys_written([*identify, *parts, *joint, "--model", model], "identify", found)
    keys_by_place(json.loads(Path(model).read_text(encoding="ascii")), "model", found)
    log = str(examples / "lathe_verification.csv")
    series = folder / "series.json"
    verify = ["verify", model, log, "--series", str(series), "--touch-every", "1h", *json_words]
    keys_written(verify, "verify", found)
    keys_by_place(json.loads(series.read_text(encoding="ascii")), "series", found)
    keys_written(["compare", model, log, *json_words], "compare", found)
    for kind, name, lines in (
        ("spindle", "lathe_spindle", '[motion]\nspeed = "n_spindle_rpm"'),
        ("etve", "lathe_verification", ""),
    ):
        setup = folder / f"{kind}.toml"
        setup.write_text(f'[probes]\nz = "Z_um"\n{lines}\n', encoding="ascii")
        words = ["thermal-test", "evaluate", str(examples / f"{name}.csv"), "--kind", kind]
        words += ["--setup", str(setup), *json_words]
        keys_written(words, "thermal-test-evaluate", found)
    _planned_tests(folder, examples, json_words, found)


def _planned_tests(
    folder: Path, examples: Path, json_words: list[str], found: dict[str, set[str]]
) -> None:
    heat, log = folder / "heat.toml", str(examples / "lathe_spindle.csv")
    heat.write_text('[sources.spindle]\ninput = "T_spindle_C-T_column_C"\n', encoding="ascii")
    plan = ["thermal-test", "plan", "--machine", str(heat), "--duration", "1h", "--after", log]
    places = ["thermal-test", "places", log, "--places", "1"]
    keys_written([*plan, *json_words], "thermal-test-plan", found)
    keys_written([*places, *json_words], "thermal-test-places", found)


@pytest.mark.proof
def test_figures_without_drift_and_uncertainties_have_the_keys_of_the_measured_figures(evaluated):
    _, result = evaluated
    measured, drift, uncertainty = (result[key] for key in ("iso230_2", "drift", "uncertainty"))
    assert isinstance(measured, dict)
    assert isinstance(drift, dict)
    assert isinstance(uncertainty, dict)
    assert drift["significant"]
    assert drift["outliers"]
    assert drift["changes"]
    assert drift["diagnosis"]
    assert set(drift["iso230_2"]) == set(measured) - {"edition"}
    assert set(drift["iso230_2"]["targets"][0]) == set(measured["targets"][0])
    assert set(drift["uncertainty"]) == set(measured) - {"edition", "targets"}
    assert drift["uncertainty"] == uncertainty["drift_free"]["expanded_uncertainty"]
    for name in ("levels_forward", "levels_backward", "levels_std_forward", "levels_std_backward"):
        assert len(drift[name]) == len(measured["targets"])


@pytest.mark.proof
def test_the_json_and_its_page_have_the_same_keys(documented, written):
    assert "adjacent_difference.forward.anomalies[]" in written
    assert {place: written[place] - documented.get(place, set()) for place in written} == {
        place: set() for place in written
    }
    tables = {place: keys for place, keys in documented.items() if keys}
    assert {place: tables[place] - written.get(place, set()) for place in tables} == {
        place: set() for place in tables
    }
