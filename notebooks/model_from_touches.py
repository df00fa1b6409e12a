# %% [markdown]
# # A model from touches
#
# **Question.** No day for a calibration test, no fixture with probes, but a touch probe in the
# spindle: can a machine learn from its own production how it warms up?
#
# The project's virtual lathe works for two days as always and touches a fixed artefact once an
# hour. No machine was measured; what holds on this lathe is proven on it alone.

# %%
import numpy as np
from matplotlib import pyplot as plt
from slides import BLUE, DARK, FILES, GREEN, GREY, ORANGE, table

from thermaxis.files import read_thermal_log
from thermaxis.thermal import (
    MeasuredOutput,
    identify,
    parse_input,
    records_of,
    simulate_log,
    verify,
)
from thermaxis.virtual import LatheSettings, VirtualLathe, log_lathe, write_lathe_log

INPUTS = [
    parse_input("spindle=T_spindle_C-T_column_C"),
    parse_input("table=T_table_C-T_column_C"),
]
HOURLY = LatheSettings(touch_every_s=3600.0)
production = log_lathe(VirtualLathe("day", 1, HOURLY), 48.0, every_s=60.0)
write_lathe_log(production, FILES / "production.parquet")

# %% [markdown]
# ## Ten lines from file to figure

# %%
log = read_thermal_log(FILES / "production.parquet")
records = records_of([log], INPUTS, ["Z_um"])
found = identify(records)
run, hours = found.outputs[0].runs[0], log.time_s / 3600.0
ten_lines, axes = plt.subplots()
axes.plot(hours, run.simulated_um, label="model of the touches, from temperatures alone")
axes.plot(hours, run.measured_um, "o", color=ORANGE, label="touches")
axes.set(xlabel="time [h]", ylabel="displacement [µm]", ylim=(-130.0, 60.0))
axes.set_title(f"A model of {np.isfinite(run.measured_um).sum()} touches in two days of production")
_ = axes.legend(loc="upper center", ncols=2)

# %% [markdown]
# ## What it is worth: three other days, judged by the truth
#
# The virtual lathe tells what no real one does: its true displacement in every minute. Beside the
# model stands what shops do: touch, and hold the value until the next touch.

# %%
model = found.to_compensation_model(records)
days = log_lathe(VirtualLathe("day", 2, HOURLY), 72.0, every_s=60.0, truth=True)
judged = verify(model, [days], [MeasuredOutput("Z_uncorrected_um", "Z_um")])
truth_um = days.column("Z_uncorrected_um")
model_um = simulate_log(model, days).outputs["Z_um"].displacement_um
touched = np.flatnonzero(np.isfinite(days.column("Z_um")))
last = np.searchsorted(touched, np.arange(days.rows), side="right") - 1
held_um = np.where(last >= 0, days.column("Z_um")[touched[np.maximum(last, 0)]], 0.0)
left = {
    "nothing": truth_um,
    "touch and hold": truth_um - held_um,
    "model of the touches": truth_um - model_um,
}
rms_um = {name: float(np.sqrt(np.mean(value**2))) for name, value in left.items()}
most_um = {name: float(np.max(np.abs(value))) for name, value in left.items()}
judged_table = table(
    ("corrected by", "RMS µm", "largest µm"),
    [(name, f"{rms_um[name]:.1f}", f"{most_um[name]:.1f}") for name in left],
)
print(judged_table)

# %%
day_hours = days.time_s / 3600.0
slide, (upper, lower) = plt.subplots(2, 1, sharex=True, figsize=(9.0, 5.2))
upper.plot(day_hours, truth_um, color=DARK, label="truth")
upper.plot(day_hours, model_um, color=BLUE, label="model, from temperatures alone")
upper.plot(
    day_hours[touched],
    days.column("Z_um")[touched],
    "o",
    color=ORANGE,
    markersize=3,
    label="touches",
)
upper.set(ylabel="displacement [µm]", title="Three days that the model never saw")
upper.set_ylim(-130.0, 70.0)
upper.legend(loc="upper right", ncols=3)
for (name, value), colour in zip(left.items(), (GREY, ORANGE, GREEN), strict=True):
    if name != "nothing":
        label = f"{name}: {rms_um[name]:.1f} µm RMS"
        lower.plot(day_hours, value, color=colour, linewidth=1.0, label=label)
lower.set(xlabel="time [h]", ylabel="left [µm]", ylim=(-70.0, 120.0))
_ = lower.legend(loc="upper right", ncols=2)

# %% [markdown]
# ## When a touch is wrong
#
# A chip on the artefact shifts one touch by 50 µm. It is left out of what is learnt, and said:

# %%
chip = dict(log.columns)
fifth = np.flatnonzero(np.isfinite(chip["Z_um"]))[4]
chip["Z_um"] = np.where(np.arange(log.rows) == fifth, chip["Z_um"] + 50.0, chip["Z_um"])
spoilt = log.to_polars().with_columns(Z_um=chip["Z_um"])
with_chip = identify(records_of([spoilt], INPUTS, ["Z_um"]))
chip_codes = [warning.code for warning in with_chip.outputs[0].warnings]
chip_um = np.abs(
    with_chip.outputs[0].runs[0].simulated_um - found.outputs[0].runs[0].simulated_um
).max()
print(f"said: {chip_codes[0]}; the model moves by {chip_um:.1f} µm at most")

# %% [markdown]
# ## What it does not say
#
# - Touches teach what the machine does **every day**. For another kind of day a calibration test
#   knows more (`docs/tutorials/learn-from-touches.md` has both).
# - A touch sees the tool centre point alone, and no table that bends.
