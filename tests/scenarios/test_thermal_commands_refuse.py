"""Commands of thermal compensation with input as users give it: a sentence, never a traceback."""

import json
import math
from collections.abc import Callable
from pathlib import Path

import pytest

from thermaxis.cli import execute, main
from thermaxis.errors import ThermaxisError

pytestmark = pytest.mark.usefixtures("one_clock_and_regime")

INPUT = ("--input", "a=T_a_C-T_b_C")
ROWS = 600
HEAD = "time_s,T_a_C,T_b_C,Z_um"

Row = Callable[[int], str]


def warm(k: int) -> str:
    """A row of a test that heats, rests and heats again, with a lag of half an hour."""
    a, z = heated(k)
    return f"{20 * k},{a:.3f},20.{k % 2},{z:.2f}"


def heated(k: int) -> tuple[float, float]:
    time_s = 20.0 * k
    on = 0.0 if k < 20 else 1.0 - math.exp(-(time_s - 400.0) / 1200.0)
    late = 0.0 if k < 20 else 1.0 - math.exp(-(time_s - 400.0) / 3600.0)
    return 20.0 + 8.0 * on + 0.02 * math.sin(1.7 * k), 100.0 * late + 0.3 * math.sin(2.3 * k)


def written(path: Path, row: Row = warm, rows: int = ROWS, head: str = HEAD) -> Path:
    path.write_text("\n".join([head, *(row(k) for k in range(rows)), ""]), encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("bad")


@pytest.fixture(scope="module")
def good(folder: Path) -> Path:
    return written(folder / "good.csv")


@pytest.fixture(scope="module")
def model(good: Path) -> Path:
    path = good.with_name("model.json")
    assert main(["identify", str(good), "--output", "Z_um", *INPUT, "--model", str(path)]) == 0
    return path


def refusal(capsys: pytest.CaptureFixture[str], *words: object) -> str:
    """Return code and text of the error of a command that must be refused, in one line."""
    capsys.readouterr()
    try:
        execute([str(word) for word in words])
    except ThermaxisError as error:
        said = f"{error.code}: {error}"
    except SystemExit as stopped:
        assert stopped.code == 2  # noqa: PT017 - beside errors of another kind
        said = capsys.readouterr().err.splitlines()[-1]
    else:
        raise AssertionError
    assert "\x1b" not in said
    assert "\n" not in said
    return said


LOGS: dict[str, tuple[bytes | None, str]] = {
    "no file": (None, "no such file"),
    "one row": (HEAD.encode() + b"\n0,20,20,0\n", "too_few_rows"),
    "constant output": (
        "\n".join([HEAD, *(f"{20 * k},{20 + 0.01 * k},20,5" for k in range(ROWS))]).encode(),
        "never changes",
    ),
    "constant inputs": (
        "\n".join([HEAD, *(f"{20 * k},20,20,{0.01 * k}" for k in range(ROWS))]).encode(),
        "no_input_changes",
    ),
    "no displacement": (
        "\n".join([HEAD, *(f"{20 * k},{20 + 0.01 * k},20," for k in range(ROWS))]).encode(),
        "No log has a value of Z_um",
    ),
    "a word among numbers": (
        "\n".join([HEAD, *(f"{k},{'warm' if k == 7 else 20},20,{k}" for k in range(50))]).encode(),
        "line 9, column T_a_C",
    ),
    "a variable that claims 2 GB": (
        b"MATLAB 5.0 MAT-file" + b" " * 105 + b"\x00\x01IM" + b"\x0f\x00\x00\x00\xff\xff\xff\x7f",
        "damaged",
    ),
    "damaged Parquet": (b"PAR1" + b"\xff" * 300 + b"PAR1", "damaged"),
}


@pytest.mark.parametrize("what", LOGS)
def test_a_log_that_allows_no_model_is_refused_in_a_sentence(what, tmp_path, capsys):
    content, expected = LOGS[what]
    log = tmp_path / "log.csv"
    if content is not None:
        log.write_bytes(content)
    files = ("--model", tmp_path / "m.json", "--json", tmp_path / "r.json")
    assert expected in refusal(capsys, "identify", log, "--output", "Z_um", *INPUT, *files)
    assert not (tmp_path / "m.json").exists()
    assert not (tmp_path / "r.json").exists()


OPTIONS: dict[str, tuple[tuple[str, ...], str]] = {
    "no input": (("--output", "Z_um"), "no_input_named"),
    "misspelt output": (("--output", "Zz_um", *INPUT), "Zz_um"),
    "misspelt channel": (("--output", "Z_um", "--input", "a=T_aa_C"), "nearest are T_a_C"),
    "a temperature as output": (("--output", "T_a_C", "--input", "a=T_b_C"), "um is needed"),
    "an input twice": (("--output", "Z_um", *INPUT, *INPUT), "stated twice"),
    "no date": (("--output", "Z_um", *INPUT, "--date", "31.3.2026"), "2026-03-31"),
    "the output as its own input": (("--output", "Z_um", "--input", "a=z_um"), "displacement"),
    "an output twice": (("--output", "Z_um", "--output", "Z_um", *INPUT), "twice"),
    "rows backwards": (
        ("--output", "Z_um", *INPUT, "--span", "10:5"),
        "the end is not after the start",
    ),
    "span behind the log": (("--output", "Z_um", *INPUT, "--span", "20h:30h"), "in 20h:30h"),
    "mask behind the log": (("--output", "Z_um", *INPUT, "--mask", "20h..30h"), "in 20h..30h"),
    "all of it masked": (("--output", "Z_um", *INPUT, "--mask", "Z_um=0..99999"), "or masked"),
    "no span": (("--output", "Z_um", *INPUT, "--span", "monday"), "is no span"),
    "means over less than a row": (
        ("--output", "Z_um", *INPUT, "--sample-time", "0.5"),
        "sample_time_too_short",
    ),
    "reference behind the log": (
        ("--output", "Z_um", *INPUT, "--reference", "300h"),
        "reference_too_long",
    ),
    "orders of modal": (("--output", "Z_um", *INPUT, "--orders", "1,1,0"), "has no orders"),
    "no orders": (("--output", "Z_um", *INPUT, "--method", "arx", "--orders", "1,1"), "na,nb,nk"),
    "candidates that are not there": (
        ("--output", "Z_um", "--candidates", "x*"),
        "no_channel_fits",
    ),
    "candidates of arx": (
        ("--output", "Z_um", "--candidates", "T*", "--method", "arx"),
        "does not choose",
    ),
    "joint gain of one displacement": (
        ("--output", "Z_um", *INPUT, "--joint", "a=Z_um@0"),
        "at least two",
    ),
}


@pytest.mark.parametrize("what", OPTIONS)
def test_an_option_that_cannot_be_met_says_why(what, good, capsys):
    words, expected = OPTIONS[what]
    assert expected in refusal(capsys, "identify", good, *words)


def test_an_option_of_another_command_is_refused_with_the_help_of_this_one(good, model, capsys):
    with pytest.raises(SystemExit):
        main(["compare", str(model), str(good), "--span", "0:100"])
    assert "--span 0:100 (see thermaxis compare --help)" in capsys.readouterr().err


def test_no_output_overwrites_what_is_read_or_another_output(good, model, capsys):
    before = good.read_bytes(), model.read_bytes()
    identify = ("identify", good, "--output", "Z_um", *INPUT)
    for option in ("--model", "--json", "--report"):
        assert "output_is_input" in refusal(capsys, *identify, option, good)
    for option in ("--json", "--report"):
        assert "output_is_input" in refusal(capsys, "verify", model, good, option, model)
        assert "output_is_input" in refusal(capsys, "verify", model, good, option, good)
    assert "output_is_input" in refusal(capsys, "compare", model, good, "--json", good)
    assert "output_is_input" in refusal(capsys, "simulate", model, good, "-o", good)
    assert "output_is_input" in refusal(capsys, "combine", model, "-o", model)
    assert "output_is_input" in refusal(capsys, "merge", good, good, "-o", good)
    both = good.with_name("both.json")
    assert "outputs_have_one_name" in refusal(capsys, *identify, "--model", both, "--json", both)
    assert not both.exists()
    assert before == (good.read_bytes(), model.read_bytes())


def test_a_log_is_not_written_under_the_name_of_another_format(good, model, capsys):
    for name in ("a.xlsx", "a.parquet", "a.MAT"):
        out = good.with_name(name)
        assert "CSV" in refusal(capsys, "simulate", model, good, "-o", out)
        assert "CSV" in refusal(capsys, "merge", good, good, "-o", out)
        assert not out.exists()


def test_a_model_that_was_changed_by_hand_is_named_with_its_key(good, model, tmp_path, capsys):
    content = json.loads(model.read_text(encoding="ascii"))
    content["outputs"][0]["parts"][0]["direct_gain_um_per_k"] += 1.0
    changed = tmp_path / "changed.json"
    changed.write_text(json.dumps(content), encoding="ascii")
    for words in (("verify", changed, good), ("compare", changed, good)):
        assert "sha256" in refusal(capsys, *words)
    del content["sha256"]
    content["outputs"][0]["parts"][0]["gain"] = 1.0
    changed.write_text(json.dumps(content), encoding="ascii")
    assert "'gain' is not a key" in refusal(capsys, "verify", changed, good)
    changed.write_text("[" * 100_000, encoding="ascii")
    assert "nested" in refusal(capsys, "simulate", changed, good, "-o", tmp_path / "s.csv")


def test_a_log_that_lacks_a_channel_of_the_model_is_refused(model, tmp_path, capsys):
    log = written(tmp_path / "other.csv", head="time_s,T_x_C,T_b_C,Z_um")
    assert "no column T_a_C" in refusal(capsys, "verify", model, log)
    assert "no column T_a_C" in refusal(capsys, "simulate", model, log, "-o", tmp_path / "s.csv")


def test_a_diameter_that_is_no_number_is_refused(good, model, capsys):
    out = good.with_name("d.csv")
    for text in ("-5", "nan", "wide"):
        assert "diameter" in refusal(capsys, "simulate", model, good, "-o", out, "--diameter", text)
        measured = f"Z_um=Z_um@{text}"
        assert "diameter" in refusal(capsys, "verify", model, good, "--measured", measured)
    assert not out.exists()


def test_time_backwards_is_mended_and_said(tmp_path, capsys):
    log = written(tmp_path / "back.csv", lambda k: warm(ROWS - 1 - k))
    assert main(["identify", str(log), "--output", "Z_um", *INPUT]) == 0
    out = capsys.readouterr().out
    assert "reading: back: " in out
    result = tmp_path / "r.json"
    assert main(["identify", str(log), "--output", "Z_um", *INPUT, "--json", str(result)]) == 0
    warnings = json.loads(result.read_text(encoding="ascii"))["warnings"]
    assert any("latest to the earliest" in text or "turned" in text for text in warnings)


def test_names_from_a_file_reach_neither_terminal_nor_report_as_commands(tmp_path, capsys):
    head = 'time_s,"=HYPERLINK(1)_C","T_b\x1b[2J_C","<script>_um"'
    log = written(tmp_path / "hostile.csv", head=head)
    files = [str(tmp_path / name) for name in ("m.json", "r.html", "s.csv")]
    words = ["--output", "<script>_um", "--input", "<b>==HYPERLINK(1)_C"]
    assert main(["identify", str(log), *words, "--model", files[0], "--report", files[1]]) == 0
    assert main(["simulate", files[0], str(log), "-o", files[2]]) == 0
    assert main(["verify", files[0], str(log)]) == 0
    assert "\x1b" not in "".join(capsys.readouterr())
    page = Path(files[1]).read_text(encoding="utf-8")
    assert "<script>_um" not in page
    assert "&lt;script&gt;_um" in page
    heading = Path(files[2]).read_text(encoding="ascii").splitlines()[0]
    assert not any(cell.strip('"')[:1] in "=+-@" for cell in heading.split(","))
