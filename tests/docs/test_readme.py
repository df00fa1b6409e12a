"""The README's picture and summary are what the program makes, and its Python lines run."""

import re

import pytest

from thermaxis.cli import main
from thermaxis.report.charts import _figures, charts_of


@pytest.mark.proof
def test_picture_and_summary_are_those_of_the_example(root, tmp_path, capsys, monkeypatch):
    def one(report):
        return tuple(c for c in charts_of(report) if c.name == "figure_10_standard_deviation")

    monkeypatch.setattr(_figures, "charts_of", one)
    example = root / "examples" / "x_axis_100_cycles.csv"
    header, limits = root / "examples" / "header.toml", root / "examples" / "limits.toml"
    words = ["evaluate", str(example), "--json", str(tmp_path / "r.json")]
    words += ["--header", str(header), "--limits", str(limits), "--figures", str(tmp_path)]
    assert main(words) == 0
    drawn = (tmp_path / "figure_10_standard_deviation.png").read_bytes()
    assert drawn == (root / "docs" / "images" / "figure_10.png").read_bytes()
    (shown,) = re.findall(
        r"```text\n(x_axis.*?)```", (root / "README.md").read_text("utf-8"), re.DOTALL
    )
    assert capsys.readouterr().out.startswith(shown)


def test_the_python_lines_run(root, monkeypatch, capsys):
    readme = (root / "README.md").read_text(encoding="utf-8")
    (code,) = re.findall(r"```python\n(.*?)```", readme, re.DOTALL)
    monkeypatch.chdir(root)
    exec(compile(code, "README.md", "exec"), {})  # noqa: S102  the README's own lines
    out = capsys.readouterr().out
    assert out.startswith("21.7")
    assert "position=3" in out
