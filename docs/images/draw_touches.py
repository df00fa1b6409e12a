"""Draw `touches.png` of the tutorial: `python docs/images/draw_touches.py cycles.csv`."""

import csv
import sys
from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")
from matplotlib import pyplot as plt

with Path(sys.argv[1]).open(encoding="utf-8", newline="") as file:
    rows = list(csv.DictReader(file))[::10]
hours, error_um, offset_um, std_um = (
    [float(row[name]) / unit for row in rows]
    for name, unit in (("time_s", 3600.0), ("Z_true_um", 1), ("offset_um", 1), ("offset_std_um", 1))
)
figure, axes = plt.subplots(figsize=(9, 4), layout="constrained")
axes.fill_between(hours, [-2 * s for s in std_um], [2 * s for s in std_um], alpha=0.2)
axes.plot(
    hours, error_um, label="true error with the compensation; band: two standard uncertainties"
)
axes.plot(hours, offset_um, label="what touches add to the correction")
axes.axvline(1.0, color="gray", linestyle=":", label="a chip: the touch is off by 50 µm")
axes.set(xlabel="time [h]", ylabel="µm", ylim=(-9.0, 15.0))
axes.legend(loc="upper left")
figure.savefig(Path(__file__).with_name("touches.png"), dpi=100)
