"""``record.toml``: every mistake is said with its place, all of them at once."""

from pathlib import Path

import pytest

from thermaxis.errors import ConfigurationError
from thermaxis.files.logs import parse_log_heading
from thermaxis.files.settings import schema_of
from thermaxis.runtime import RecordSettings, read_record
from thermaxis.runtime.record._config import RecordFile

CONNECTION = """
[connection.control]
url = "opc.tcp://127.0.0.1:4840"
security = "none"
"""
CHANNEL = """
[channel.T_spindle_C]
node = "ns=2;s=/Plc/T_spindle"
unit = "degC"
"""


def read(folder: Path, text: str) -> RecordSettings:
    path = folder / "record.toml"
    path.write_text(text, encoding="utf-8")
    return read_record(path)


def refusal(folder: Path, text: str) -> list[tuple[str, str]]:
    """Return code and key of everything that is wrong."""
    with pytest.raises(ConfigurationError) as caught:
        read(folder, text)
    assert caught.value.place.file == str(folder / "record.toml")
    every = caught.value.values.get("problems", (caught.value.message,))
    return [(one.code.removeprefix("error-"), one.place.key) for one in every]


def test_a_short_configuration_has_sensible_values_for_the_rest(tmp_path: Path) -> None:
    settings = read(tmp_path, CONNECTION + CHANNEL)
    (channel,) = settings.channels
    assert (channel.name, channel.heading, channel.unit) == ("T_spindle_C", "T_spindle_C", "degC")
    assert (channel.connection, channel.period_ms, channel.factor) == ("control", 1000, 1.0)
    assert (settings.name, settings.days_per_file, settings.keep_days) == ("log", 1, None)
    assert settings.connections["control"].url == "opc.tcp://127.0.0.1:4840"
    assert settings.fastest_ms == 1000


def test_a_number_of_thousands_of_digits_is_refused(tmp_path: Path) -> None:
    assert refusal(tmp_path, f"a = 0x{'f' * 9_000}") == [("not_toml", "")]


def test_rates_and_repetition_are_those_of_the_channel_before_those_of_the_record(
    tmp_path: Path,
) -> None:
    text = (
        "[record]\nevery_s = 0.25\nrepeat_unchanged_s = 60\n"
        + CONNECTION
        + CHANNEL
        + '[channel.T_b_C]\nnode = "i=85"\nunit = "degC"\nevery_s = 30\nrepeat_unchanged_s = 5\n'
    )
    settings = read(tmp_path, text)
    assert [c.period_ms for c in settings.channels] == [250, 30_000]
    assert [c.repeat_unchanged_s for c in settings.channels] == [60.0, 5.0]


def test_a_reader_finds_name_and_unit_in_the_heading(tmp_path: Path) -> None:
    for name, unit in (
        *(("T_spindle_C", "degC"), ("T_spindle_C", "°C"), ("Z_um", "um"), ("speed", "rpm")),
        *(("load", "%"), ("on", "bool"), ("count", "1"), ("Spindle.Temp-1", "K")),
    ):
        text = f'{CONNECTION}[channel."{name}"]\nnode = "i=85"\nunit = "{unit}"\n'
        (channel,) = read(tmp_path, text).channels
        found = parse_log_heading(channel.heading)
        assert (found.name, found.unit, found.time_rank) == (name, channel.unit, None)


GOOD = '[channel.T_C]\nnode = "i=85"\nunit = "degC"\n'
WRONG = (
    (GOOD.replace("node", "nod"), "unknown_key_near", "nod"),
    (GOOD.replace('unit = "degC"\n', ""), "key_needed", "unit"),
    (GOOD.replace("degC", "Grad"), "unknown_unit", "unit"),
    (GOOD.replace("degC", "K"), "unit_differs", "unit"),
    (GOOD.replace("i=85", "2;x"), "no_node_id", "node"),
    (GOOD + 'counter_node = "2;x"\n', "no_node_id", "counter_node"),
    (GOOD.replace("T_C", "Zeit").replace("degC", "1"), "name_of_times", "channel.Zeit"),
    (GOOD.replace("T_C", "date").replace("degC", "1"), "name_of_times", "channel.date"),
    (GOOD.replace("T_C", '"T,C"'), "no_channel_name", "channel.T,C"),
    (f"{GOOD}every_s = 0.01\n", "below_bound", "every_s"),
    (f"{GOOD}every_s = 0.1234567\n", "no_whole_milliseconds", "every_s"),
    (f"{GOOD}every_s = nan\n", "not_finite", "every_s"),
    (f"{GOOD}factor = 0\n", "scale_zero", "factor"),
    (f"{GOOD}factor = true\n", "no_number", "factor"),
    (f'{GOOD}connection = "x"\n', "unknown_name", "connection"),
    (f"[record]\nname = '../x'\n{CHANNEL}", "no_file_name", "record.name"),
    (f"[record]\nkeep_days = 1\n{CHANNEL}", "below_bound", "record.keep_days"),
    (f"[record]\ndays_per_file = 1.5\n{CHANNEL}", "no_whole_number", "record.days_per_file"),
    ("[channel]\n", "channels", "channel"),
    (
        CHANNEL + CHANNEL.replace("T_spindle_C", "t_SPINDLE_C"),
        "same_but_case",
        "channel.t_SPINDLE_C",
    ),
)


def test_a_mistake_is_said_with_its_place_and_a_remedy(tmp_path: Path) -> None:
    for table, code, key in WRONG:
        place = key if key.startswith(("record", "channel")) else f"channel.T_C.{key}"
        assert (code, place) in refusal(tmp_path, CONNECTION + table), table


def test_several_mistakes_are_said_at_once(tmp_path: Path) -> None:
    said = refusal(
        tmp_path,
        CONNECTION
        + '[channel.a_C]\nnode = "i=85"\nunit = "Grad"\n'
        + '[channel.b_C]\nnode = "nonsense"\nunit = "degC"\n',
    )
    assert said == [("unknown_unit", "channel.a_C.unit"), ("no_node_id", "channel.b_C.node")]


def test_a_mistake_is_said_with_its_line(tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError) as caught:
        read(tmp_path, CONNECTION + CHANNEL.replace("degC", "Grad"))
    assert (caught.value.code, caught.value.place.line) == ("unknown_unit", 8)


def test_a_channel_says_its_connection_where_there_are_several(tmp_path: Path) -> None:
    two = CONNECTION + CONNECTION.replace("control", "probes")
    found = refusal(tmp_path, two + CHANNEL)
    assert found == [("connection_unstated", "channel.T_spindle_C.connection")]
    settings = read(tmp_path, two + CHANNEL + 'connection = "probes"\n')
    assert list(settings.connections) == ["probes"]  # the other one is not needed


def test_there_is_no_recording_without_a_connection(tmp_path: Path) -> None:
    assert refusal(tmp_path, "[connection]\n" + CHANNEL) == [("no_connection", "connection")]
    assert refusal(tmp_path, CHANNEL) == [("key_needed", "connection")]


def test_the_page_on_recording_names_every_key_and_its_example_is_right(
    root: Path, tmp_path: Path
) -> None:
    page = (root / "docs" / "settings.md").read_text(encoding="utf-8")
    shown = (root / "docs" / "how-to" / "record-a-log.md").read_text(encoding="utf-8")
    rows = [line for line in page.splitlines() if line.startswith("| `")]
    keys = " ".join(line.split("|")[1] for line in rows)
    for table in ("RecordSettings", "ChannelSettings"):
        for name in schema_of(RecordFile)["$defs"][table]["properties"]:
            assert f"`{name}`" in keys, name
    for folder, name in (("secrets", "control"), ("pki", "own.der"), ("pki", "own.pem")):
        (tmp_path / folder).mkdir(exist_ok=True)
        (tmp_path / folder / name).write_text("x\n")
        (tmp_path / folder / name).chmod(0o600)
    (tmp_path / "pki" / "control.der").write_text("x")
    example = shown.split("```toml\n")[1].split("```")[0]
    settings = read(tmp_path, example)
    assert [c.heading for c in settings.channels] == [
        "T_spindle_C",
        "T_column_C",
        "Z_um",
        "speed [rpm]",
    ]
    assert [c.period_ms for c in settings.channels] == [1000, 10_000, 1000, 1000]


def test_the_page_on_recording_states_the_defaults_that_hold(root: Path) -> None:
    page = (root / "docs" / "settings.md").read_text(encoding="utf-8")
    stated = [
        (line.split("`")[1], line.split("|")[3].strip())
        for line in page.splitlines()
        if line.startswith("| `") and line.count("|") == 4
    ]
    for name in ("every_s", "days_per_file", "largest_mb", "memory_mb", "repeat_unchanged_s"):
        assert (name, f"{getattr(RecordSettings(), name):g}") in stated
