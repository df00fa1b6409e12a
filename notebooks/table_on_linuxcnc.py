# %% [markdown]
# # A table proven on LinuxCNC
#
# **Question.** A compensation table has a sign, a unit, an order of columns and a type. Before it
# reaches a machine: does the control do with it what is meant, and does the axis get better at
# places that were never measured?
#
# An axis of 160 mm with pitch error, 3 µm of reversal and thermal drift is measured, its table is
# written as the `.comp` file of LinuxCNC, and the axis is measured again at **other** targets.
# No machine was measured: the axis is virtual.

# %%
from dataclasses import replace

import numpy as np
from matplotlib import pyplot as plt
from slides import FILES, GREEN, GREY, ORANGE, table

from tests.system.linuxcnc.machine import Table, missing, run_program
from thermaxis.controls import TableRequest, check_options, control_by_name
from thermaxis.files import read_positioning, write_tidy_csv
from thermaxis.positioning import (
    axis_levels,
    compensation_table,
    evaluate_drift,
    evaluate_iso230_2,
    measured_levels,
    table_points,
)
from thermaxis.quantities import AxisKind
from thermaxis.virtual import (
    AxisGeometry,
    AxisThermal,
    ReadingScatter,
    RunPlan,
    VirtualAxis,
    WarmUp,
    generate_positioning_run,
)

SEED = 7
AXIS = VirtualAxis(
    plan=RunPlan(targets=41, first=-80.0, interval=4.0, cycles=3, recording_s=1.0),
    geometry=AxisGeometry(straight_line_um_per_m=60.0, pitch_error=5.0, reversal=-3.0),
    thermal=AxisThermal(structure=(WarmUp(10.0, 1200.0),), screw_expansion_um_per_m=40.0),
    scatter=ReadingScatter(noise=0.1),
)
first = generate_positioning_run(AXIS, seed=SEED)
write_tidy_csv(first.test, FILES / "run.csv")

# %% [markdown]
# ## Ten lines from file to figure

# %%
run = read_positioning(FILES / "run.csv")
drift = evaluate_drift(run)
linuxcnc = control_by_name("linuxcnc")
options = check_options(linuxcnc, ["type=1"], purpose="table")
levels = {"as measured": measured_levels(run), "drift-free": axis_levels(run.target, drift.level)}
ten_lines, axes = plt.subplots()
for name, one in levels.items():
    axes.plot(one.target, one.level, label=[f"{name}, {side}" for side in ("forward", "backward")])
axes.set(xlabel="position [mm]", ylabel="deviation [µm]", title="What a table is made of")
_ = axes.legend()

# %% [markdown]
# ## The file that the control gets
#
# Three columns: position, what is added forward, and in reverse. Read back as LinuxCNC reads it,
# which is not always what was meant: a blank line or a comment would end the table without a word.

# %%
points = table_points(run.target, points=81)
files, read = {}, {}
for name, one in levels.items():
    wanted = compensation_table(one, points, kind=AxisKind.LINEAR, axis="X", reference_position=0.0)
    files[name] = linuxcnc.format_table(TableRequest(table=wanted, options=options)).text
    read[name] = linuxcnc.read_table(files[name], f"{name}.comp", AxisKind.LINEAR, options)
print("\n".join(files["drift-free"].splitlines()[:4]))
print("findings of the reader:", [finding.code for finding in read["drift-free"].findings])

# %% [markdown]
# ## The control
#
# Where LinuxCNC is installed (`apt-get install --no-install-recommends linuxcnc-uspace`), a real
# one without a machine drives joint 0 from end to end and back with this table, and every servo
# period is compared. Elsewhere the correction is what the reader of the `.comp` file works out.

# %%
text = files["drift-free"]
if missing():
    proof = "the meaning of the .comp file: no LinuxCNC is installed here"
    servo, difference_nm = None, float("nan")
else:
    moves = "\n".join(f"G53 G1 X{end}" for end in (run.target[0], run.target[-1], run.target[0]))
    program = f"G21 G90 G61.1\nF4000\n{moves}\nM2\n"
    trace = run_program(program, tables=(Table(text, 1),), limit_s=40.0)
    moving = np.flatnonzero(trace.velocity)
    side = (trace.velocity[moving] < 0.0).astype(int)
    meant = linuxcnc.correction(read["drift-free"].table, trace.position[moving])
    servo = 1e3 * trace.corrections[moving, 0]
    difference_nm = 1e3 * float(np.max(np.abs(servo - meant[np.arange(side.size), side])))
    proof = f"LinuxCNC itself: {moving.size} servo periods differ by {difference_nm:.0e} nm at most"
print("proven on", proof)

# %% [markdown]
# ## The axis with the table, at other targets
#
# The machine keeps the thermal state of the mean time of the first run, for which the drift-free
# table holds. 33 targets every 5 mm: nine of them were targets of the first run, every 20 mm.

# %%
OTHER = replace(AXIS, plan=replace(AXIS.plan, targets=33, interval=5.0, cycles=2))
still = generate_positioning_run(replace(OTHER, thermal=AxisThermal()), seed=SEED).test
state_s = np.array(drift.reference_time_s + float(np.nanmin(first.motion_time_s)))
warm = AXIS.thermal.drift(still.target, state_s)
state = replace(still, deviation=still.deviation + warm[:, None, None])
with_table = {"no table": state}
for name, one in read.items():
    correction = linuxcnc.correction(one.table, still.target)
    with_table[name] = replace(state, deviation=state.deviation + correction[:, None, :])
e_um = {name: float(evaluate_iso230_2(one).E) for name, one in with_table.items()}
b_um = {name: float(evaluate_iso230_2(one).B) for name, one in with_table.items()}
left_table = table(
    ("table", "E at other targets µm", "largest reversal there µm"),
    [(name, f"{e_um[name]:.2f}", f"{b_um[name]:.2f}") for name in with_table],
)
print(left_table)

# %%
slide, panels = plt.subplots(1, 2, figsize=(9.5, 4.2), sharey=True)
for axes, names in zip(panels, (("no table",), ("as measured", "drift-free")), strict=True):
    for name in names:
        colour = {"no table": GREY, "as measured": ORANGE, "drift-free": GREEN}[name]
        mean = with_table[name].deviation.mean(axis=1)
        mean = mean - mean.mean()
        for side, line in ((0, "o-"), (1, "o--")):
            label = f"{name}: E = {e_um[name]:.1f} µm" if side == 0 else None
            axes.plot(still.target, mean[:, side], line, color=colour, markersize=3, label=label)
    axes.set(xlabel="position [mm]", title="Without a table" if len(names) == 1 else "With a table")
    axes.legend()
panels[0].set_ylabel("mean deviation, ↑ solid, ↓ dashed [µm]")
way = "seen on LinuxCNC" if servo is not None else "that the .comp file means"
_ = slide.suptitle(f"At other targets, with the correction {way}")

# %% [markdown]
# ## What it does not say
#
# - That the table fits **your** machine, that its sign is right there, or that the way is free.
#   Load it, measure two points with and without it, and only then use it.
# - A table removes no drift: what the whole axis has moved by stays, and E, a range, does not see
#   it.
# - `tests/system/test_linuxcnc.py` does all of it on LinuxCNC: plans, dwells, six strange tables,
#   both types; `docs/how-to/prove-a-table-on-linuxcnc.md` has its figures.
