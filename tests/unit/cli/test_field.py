"""The command ``field``: tables for people, JSON for programs, one error for bad input."""

import json
import re

import numpy as np
import pytest

from benchmarks.virtual_table import VirtualTable, format_field_csv, generate_thermal_field
from tests.unit.cli.refusals import code_of, refusal
from thermaxis.cli import execute
from thermaxis.files import read_field_csv, read_positioning
from thermaxis.positioning import evaluate_drift
from thermaxis.thermal import correct_emissivity

REGIONS = """
[regions.motor]
x_px = [0, 20]
y_px = [10, 50]
[regions.far]
x_mm = [240.0, 320.0]
y_mm = [0.0, 240.0]
"""


def run(*words: object) -> int:
    return execute(["field", *map(str, words)])


def as_json(capsys, *words):
    capsys.readouterr()
    assert run(*words, "--json", "-") == 0
    shown = capsys.readouterr()
    assert shown.err == ""
    return json.loads(shown.out)


def warned(found):
    """Return the values of warnings by their codes."""
    return {one["code"].partition("-")[2]: one["values"] for one in found["warning_codes"]}


@pytest.fixture(scope="module")
def examples(root):
    return root / "examples" / "field_before.csv", root / "examples" / "field_after.csv"


@pytest.fixture(scope="module")
def warming(tmp_path_factory):
    """Five images of a table that warms up for seven hours."""
    folder = tmp_path_factory.mktemp("warming")
    paths = []
    for k, hours in enumerate((0.0, 1.0, 2.5, 4.5, 6.9)):
        image = generate_thermal_field(VirtualTable(), 3600.0 * hours, seed=k)
        paths.append(folder / f"image_{k}.csv")
        paths[-1].write_text(format_field_csv(image.temperature_c), encoding="utf-8")
    return paths


@pytest.fixture
def write(tmp_path):
    def write(text, name):
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return path

    return write


def test_the_examples_are_compared_in_words(examples, capsys):
    assert run(*examples) == 0
    shown = capsys.readouterr()
    assert shown.err == ""
    assert "Thermal fields of 80 x 60 pixels" in shown.out
    assert re.search(r"whole +4800 +24\.000 +29\.879 +\+5\.880", shown.out)
    assert re.search(r"upper right +1200 .* \+5\.363", shown.out)
    assert "warning" not in shown.out


def test_the_json_holds_what_a_plain_computation_gives(examples, capsys):
    found = as_json(capsys, *examples)
    before, after = (read_field_csv(path).temperature_c for path in examples)
    assert (found["rows"], found["columns"]) == (60, 80)
    assert found["difference"]["mean_k"] == pytest.approx((after - before).mean())
    assert found["difference"]["max_k"] == pytest.approx((after - before).max())
    quarter = found["regions"][1]
    assert quarter["name"] == "upper left"
    assert quarter["mean_c"][1] == pytest.approx(after[:30, :40].mean())
    assert quarter["change_k"] == pytest.approx((after - before)[:30, :40].mean())
    assert found["drift"] is None
    assert found["images"][0]["time_s"] is None
    assert set(found) == {
        *("version", "rows", "columns", "mm_per_pixel", "emissivity", "reflected_temperature_c"),
        *("images", "difference", "regions", "drift", "warnings", "warning_codes"),
    }


def test_regions_come_from_a_file_in_pixels_and_millimetres(examples, write, capsys):
    regions = write(REGIONS, "regions.toml")
    found = as_json(capsys, *examples, "--regions", regions, "--scale", "4")["regions"]
    after = read_field_csv(examples[1]).temperature_c
    assert [one["name"] for one in found] == ["motor", "far"]
    assert found[0]["mean_c"][1] == pytest.approx(after[10:50, :20].mean())
    assert found[1]["mean_c"][1] == pytest.approx(after[:, 60:].mean())
    assert found[1]["x_px"] == [60.0, 80.0]


@pytest.mark.parametrize(
    ("text", "code", "key"),
    [
        ("", "number_of_regions", "regions"),
        ("[regions.a]\nx_px = [0, 20]\n", "edges_missing", "regions.a.y_px"),
        (
            "[regions.a]\nx_px = [0, 2]\ny_px = [0, 2]\ny_mm = [0, 2]\n",
            "edges_stated_twice",
            "regions.a.y_px",
        ),
        ("[regions.a]\nx_px = [0, nan]\ny_px = [0, 2]\n", "not_finite", "regions.a.x_px[1]"),
        ("[regions.a]\nx_px = [0, 1, 2]\ny_px = [0, 2]\n", "impossible_value", "regions.a.x_px"),
        ("[regions.a]\nx_px = 'all'\ny_px = [0, 2]\n", "not_a_list", "regions.a.x_px"),
        ("[regions.a]\nx_px = [2, 0]\ny_px = [0, 2]\n", "edges_not_rising", "regions.a.x_px"),
        ("[regions.a]\nx_mm = [0, 2]\ny_px = [0, 2]\n", "scale_missing", "regions.a.x_mm"),
    ],
)
def test_a_wrong_file_of_regions_is_one_error(examples, write, text, code, key):
    error = refusal("field", *examples, "--regions", write(text, "regions.toml"))
    assert (error.code, error.place.key) == (code, key)
    assert error.place.file.endswith("regions.toml")


def test_tables_keys_and_regions_that_are_none_are_refused(examples, write):
    for text in ("[region.a]\nx_px = [0, 1]\n", "regions = 3\n", "x"):
        refusal("field", *examples, "--regions", write(text, "regions.toml"))
    outside = "[regions.a]\nx_px = [0, 81]\ny_px = [0, 2]\n"
    refusal("field", *examples, "--regions", write(outside, "regions.toml"))


def test_the_emissivity_is_corrected_and_this_is_said(examples, capsys):
    options = ("--emissivity", "0.9", "--reflected-temperature", "22")
    found = as_json(capsys, *examples, *options)
    after = read_field_csv(examples[1]).temperature_c
    corrected = correct_emissivity(after, emissivity=0.9, reflected_c=22.0)
    assert found["images"][1]["mean_c"] == pytest.approx(corrected.mean())
    assert found["emissivity"] == 0.9
    assert found["reflected_temperature_c"] == 22.0
    assert "emissivity of 0.9" in found["warnings"][0]
    assert len(found["warnings"]) == 1
    shiny = as_json(capsys, *examples, "--emissivity", "0.4", "--reflected-temperature", "22")
    assert "below 0.6" in shiny["warnings"][1]


@pytest.mark.proof
def test_two_images_stand_beside_the_drift_and_have_no_correlation(examples, root, capsys):
    path = root / "examples" / "x_axis_100_cycles.csv"
    found = as_json(capsys, *examples, "--run", path)
    drift = evaluate_drift(read_positioning(path))
    assert found["drift"]["common"] == pytest.approx(drift.common[[0, -1]].tolist())
    assert found["drift"]["slope"] == pytest.approx((1000 * drift.slope[[0, -1]]).tolist())
    assert found["drift"]["correlation_common"] == []
    assert warned(found) == {
        "images_without_times": {},
        "images_without_correlation": {"images": 2},
    }
    run(*examples, "--run", path)
    assert "Drift of x_axis_100_cycles.csv (model: smooth)" in capsys.readouterr().out


def test_options_say_how_the_run_is_read(examples, tmp_path):
    path = tmp_path / "run.csv"
    rows = [f"{t};1,234;2,345;1,234;2,345" for t in (0, 100, 200)]
    path.write_text("\n".join(["target;1;2;3;4", *rows, ""]), encoding="utf-8")
    assert refusal("field", *examples, "--run", path, "--units", "mm,um").code == (
        "decimal_sign_unclear"
    )
    assert refusal("field", *examples, "--decimal", "comma").code == "option_needs"


@pytest.mark.proof
def test_images_with_times_are_related_to_the_drift(warming, root, capsys):
    path = root / "examples" / "x_axis_100_cycles.csv"
    words = (*warming, "--run", path, "--times", "0", "1", "2.5", "4.5", "6.9")
    found = as_json(capsys, *words)
    drift = evaluate_drift(read_positioning(path))
    hours = np.array([0.0, 1.0, 2.5, 4.5, 6.9])
    slope = 1000 * np.interp(3600 * hours, drift.time_s, drift.slope)
    means = np.array(found["regions"][0]["mean_c"])
    whole = found["drift"]["correlation_slope"][0]
    assert found["drift"]["slope"] == pytest.approx(slope.tolist())
    assert whole["region"] == "whole"
    assert whole["correlation"] == pytest.approx(np.corrcoef(means, slope)[0, 1])
    assert whole["correlation"] > 0.9
    assert whole["per_k"] == pytest.approx(np.polyfit(means, slope, 1)[0])
    assert warned(found) == {"correlation_no_proof": {}}
    run(*words)
    shown = capsys.readouterr().out
    assert "Region and growth of the axis b(t), 5 images" in shown
    assert "image 5" in shown


@pytest.mark.proof
def test_an_image_outside_the_run_is_left_out_of_the_relation(warming, root, capsys):
    path = root / "examples" / "x_axis_100_cycles.csv"
    words = (*warming, "--run", path, "--times", "-0.2", "1", "2.5", "4.5", "20")
    found = as_json(capsys, *words)
    assert found["drift"]["images"] == 4
    assert found["drift"]["common"][4] is None
    assert warned(found).keys() >= {"image_at_edge_of_run", "image_outside_run"}
    assert warned(found)["image_outside_run"] == {"images": "5"}
    run(*words)
    assert "–" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("options", "code", "key"),
    [
        (("--emissivity", "0.9"), "option_needs", "--emissivity"),
        (("--reflected-temperature", "20"), "option_needs", "--reflected-temperature"),
    ],
)
def test_an_option_that_is_not_possible_is_one_error(examples, options, code, key):
    error = refusal("field", *examples, *options)
    assert (error.code, error.place.key) == (code, key)


def test_times_that_do_not_fit_and_files_that_are_not_there_are_refused(examples, capsys):
    for options in (
        ("--times", "0"),
        ("--times", "1", "0"),
        ("--regions", "nothing.toml"),
        ("--run", "nothing.csv"),
    ):
        refusal("field", *examples, *options)
        assert capsys.readouterr().out == ""


def test_more_than_two_images_beside_a_run_need_times(warming, root):
    error = refusal("field", *warming, "--run", root / "examples" / "x_axis_100_cycles.csv")
    assert (error.code, error.values["needed"]) == ("option_needs", "--times")


def test_one_image_is_an_error(examples):
    error = refusal("field", examples[0])
    assert (error.code, error.values) == ("too_few_images", {"images": 1})


def test_no_output_replaces_an_image_and_a_file_is_no_folder(tmp_path, examples):
    image = tmp_path / "image.csv"
    image.write_bytes(examples[0].read_bytes())
    assert code_of("field", image, examples[1], "--json", image) == "output_is_input"
    assert code_of("field", *examples, "--figures", image) == "charts_need_folder"


def test_a_jpeg_is_read_as_one_whatever_its_name(examples, tmp_path):
    photo = tmp_path / "photo.csv"
    photo.write_bytes(b"\xff\xd8\xff\xe0" + bytes(50))
    assert "JPEG" in str(refusal("field", photo, examples[1]))


def test_the_charts_are_written_with_their_numbers(examples, tmp_path):
    run(*examples, "--figures", tmp_path / "one", "--scale", "4")
    names = {path.name for path in (tmp_path / "one").iterdir()}
    charts = ("field_difference", "field_images", "field_regions")
    assert names == {f"{chart}.{kind}" for chart in charts for kind in ("png", "svg", "csv")}
    lines = (tmp_path / "one" / "field_difference.csv").read_text(encoding="utf-8").splitlines()
    assert lines[0] == "x_mm,y_mm,difference_k"
    assert len(lines) == 1 + 4800
    assert lines[1].startswith("2.0,2.0,")
    regions = (tmp_path / "one" / "field_regions.csv").read_text(encoding="utf-8").splitlines()
    assert regions[2].startswith("upper left,0.0,40.0,0.0,30.0,1200,")


@pytest.mark.proof
def test_level_images_holes_and_hostile_names_are_drawn(tmp_path, capsys):
    level = np.full((30, 40), 20.0)
    hole = level + 5.0
    hole[5:12, 5:20] = np.nan
    names = ("$\\frac{.csv", "=level.csv", "hole.csv")
    for name, values in zip(names, (level, level, hole), strict=True):
        (tmp_path / name).write_text(format_field_csv(values), encoding="utf-8")
    run(*(tmp_path / name for name in names), "--figures", tmp_path / "charts")
    shown = capsys.readouterr().out
    assert "105 of 1200 pixels are missing" in shown
    images = (tmp_path / "charts" / "field_images.csv").read_text(encoding="utf-8").splitlines()
    assert images[2].startswith("2,'=level.csv,,0,20.0,")
