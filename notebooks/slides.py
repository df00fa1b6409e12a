"""What the notebooks share: where the examples are, how a picture looks, and a table.

python notebooks/slides.py FOLDER [NOTEBOOK ...]    every picture as PNG
"""

import os
import runpy
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")  # small matrices: threads get in each other's way

import matplotlib as mpl
import polars as pl
from matplotlib import pyplot as plt
from matplotlib.figure import Figure

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent
"""The project's folder: `examples/`, and `benchmarks/` with machines made for tests."""
_FILES = tempfile.TemporaryDirectory(prefix="thermaxis-")
FILES = Path(_FILES.name)
"""What a notebook writes: gone when it has ended."""
BLUE, ORANGE, GREEN, GREY, DARK = "#0072b2", "#d55e00", "#009e73", "#9a9a9a", "#333333"
"""Told apart with all usual colour deficiencies."""

if str(ROOT) not in sys.path:
    sys.path.insert(0, str(ROOT))

plt.rcParams.update(
    {
        "figure.figsize": (9.0, 4.4),
        "figure.constrained_layout.use": True,
        "font.size": 11.0,
        "axes.titlesize": 12.0,
        "axes.titlelocation": "left",
        "axes.spines.top": False,
        "axes.spines.right": False,
        "axes.grid": True,
        "axes.axisbelow": True,
        "grid.color": "#e4e4e4",
        "legend.frameon": False,
        "axes.prop_cycle": mpl.cycler(color=[BLUE, ORANGE, GREEN, "#cc79a7", DARK]),
    }
)


def table(columns: Sequence[str], rows: Sequence[Sequence[object]]) -> pl.DataFrame:
    """Return a table whose cells are texts, and let frames print whole."""
    pl.Config(
        tbl_rows=-1,
        tbl_cols=-1,
        fmt_str_lengths=200,
        tbl_width_chars=160,
        tbl_hide_dataframe_shape=True,
        tbl_hide_column_data_types=True,
    )
    return pl.DataFrame([list(map(str, row)) for row in rows], schema=list(columns), orient="row")


def run(name: str) -> dict[str, object]:
    """Run a notebook as `python notebooks/NAME.py` does, and return its names."""
    plt.close("all")
    if str(HERE) not in sys.path:
        sys.path.insert(0, str(HERE))
    return runpy.run_path(str(HERE / f"{name}.py"))


def figures_of(names: dict[str, object]) -> dict[str, Figure]:
    """Return the pictures of a notebook, by name."""
    return {name: value for name, value in names.items() if isinstance(value, Figure)}


def notebook_names() -> list[str]:
    """Return the names of all notebooks."""
    return sorted(path.stem for path in HERE.glob("*.py") if path.stem != "slides")


if __name__ == "__main__":
    folder, *asked = sys.argv[1:]
    Path(folder).mkdir(parents=True, exist_ok=True)
    for notebook in asked or notebook_names():
        for name, figure in figures_of(run(notebook)).items():
            path = Path(folder) / f"{notebook}-{name}.png"
            figure.savefig(path, dpi=110)
            print(path)
