"""What a start of the command line imports, and what it says when a package is missing."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from tests.proofs import quick_first
from tests.unit.cli.refusals import refusal
from thermaxis.cli import main
from thermaxis.codes import Place
from thermaxis.errors import DataError

EXAMPLE = Path(__file__).resolve().parents[3] / "examples" / "x_axis_100_cycles.csv"
LOG = EXAMPLE.with_name("lathe_spindle.csv")
MODELS = [str(EXAMPLE.parent / "models" / "spindle_table.json")]
CHARTS = {"matplotlib", "typst"}
HEAVY = CHARTS | {"asyncua", "cryptography", "numpy", "polars", "pydantic", "scipy", "sqlalchemy"}


@pytest.mark.parametrize(
    ("words", "unwanted"),
    [
        (["--help"], HEAVY | {"thermaxis.cli.axis", "thermaxis.report"}),
        (["evaluate", str(EXAMPLE), "--no-drift"], HEAVY - {"numpy", "scipy"}),
        pytest.param(
            ["compare", *MODELS, str(LOG)],
            CHARTS | {"asyncua", "scipy.signal", "scipy.stats"},
            marks=pytest.mark.proof,
        ),
    ],
)
def test_nothing_is_imported_that_is_not_needed(words, unwanted):
    code = f"""
import contextlib, io, sys
from thermaxis.cli import main
with contextlib.suppress(SystemExit), contextlib.redirect_stdout(io.StringIO()):
    assert main({words!r}) == 0
print(sorted({unwanted!r} & set(sys.modules)))
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize(
    ("command", "package", "extra"),
    quick_first(
        2,
        [
            ("user", "argon2", "machine"),
            ("fleet", "sqlalchemy", "fleet"),
            ("screen", "asyncua", "machine"),
        ],
    ),
)
def test_a_missing_package_is_named_with_the_extra_that_brings_it(command, package, extra):
    code = f"""
import sys
sys.modules[{package!r}] = None
from thermaxis.cli import main
sys.exit(main([{command!r}, "--help"]))
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert f"pip install 'thermaxis[{extra}]'" in done.stderr
    assert done.stderr.count("\n") == 1


def test_without_a_command_the_help_is_shown(capsys):
    assert main([]) == 0
    assert "evaluate" in capsys.readouterr().out


def test_unknown_words_are_refused(capsys):
    with pytest.raises(SystemExit) as stopped:
        main(["evaluat"])
    assert stopped.value.code == 2
    assert "invalid choice" in capsys.readouterr().err


def test_an_error_where_json_alone_was_asked_for_is_json_too(tmp_path, capsys):
    asked = ["plan", "--length", "100", "--targets", "6", "--standard", "--json"]
    assert main([*asked, "-"]) == 2
    printed = capsys.readouterr()
    error = json.loads(printed.out)["error"]
    assert (error["code"], error["place"]) == ("option_needs", {"key": "--standard"})
    assert error["values"] == {"option": "--standard", "needed": "--target-uncertainty"}
    assert printed.err == f"thermaxis: error: {error['text']}\n"
    assert main([*asked, str(tmp_path / "r.json")]) == 2
    assert list(tmp_path.iterdir()) == []


def test_a_report_that_cannot_be_written_leaves_one_value_where_json_alone_was_asked_for(
    tmp_path, capsys, monkeypatch
):
    def fail(*_: object, **__: object) -> None:
        raise DataError("file_unwritable", place=Place("r.html"), cause="No space left on device")

    monkeypatch.setattr("thermaxis.report.write_report", fail)
    assert main(["evaluate", str(EXAMPLE), "--report", str(tmp_path / "r.html"), "--json=-"]) == 2
    assert json.loads(capsys.readouterr().out)["error"]["code"] == "file_unwritable"


def test_without_a_probe_a_person_confirms_that_the_offset_moves(root):
    lathe = root / "examples" / "machine" / "lathe.toml"
    refused = refusal("commission", lathe, "--probe", "", "--yes")
    assert (refused.code, refused.place.key) == ("option_needs", "--yes")
