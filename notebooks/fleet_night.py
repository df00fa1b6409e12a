# %% [markdown]
# # A fleet's night
#
# **Question.** Six machines ship the minutes of their days to a lake. Every night each is compared
# with its own model. Which of them needs a person in the morning, and why?
#
# The fleet is `benchmarks/fleet_machines.py`: no machine exists. Each works 8 to 16 hours a day, is
# touched every half hour, has sensors of tenths of a kelvin and what its model does not know. Two
# have a fault that begins after ten days; the program is not told which. `make demo-fleet` does the
# same with forty.

# %%
from datetime import timedelta

import polars as pl
from matplotlib import pyplot as plt
from slides import BLUE, DARK, FILES, GREY, ORANGE, table

from benchmarks import fleet_machines as machines
from benchmarks.demo_fleet import BACK, delivered
from thermaxis.files import parse_model
from thermaxis.fleet import Lake, NightJob, Registry, do_nights, serial_engine
from thermaxis.messages import sentence_of
from thermaxis.thermal import simulate_log

HALL = machines.Hall(seed=11, days=13, fault_share=0.34)
FLEET = machines.machines_of(HALL, 6)
DAYS = [HALL.first + timedelta(days=k) for k in (11, 12)]
(FILES / "lake").mkdir(exist_ok=True)
(FILES / "registry.db").unlink(missing_ok=True)

# %% [markdown]
# Each machine works for thirteen days, ships them, and has a model of its first ten. Then the
# nights: those that are missing, each stored once. Here one after the other, in a shop on a
# cluster.

# %%
with (
    Registry.make(f"sqlite:///{FILES / 'registry.db'}", str(FILES / "lake")) as registry,
    serial_engine() as engine,
):
    for one in FLEET:
        registry.add(delivered(FILES, one), "from its first ten days")
    for day in DAYS:
        jobs = [NightJob(one, day, BACK, registry.lake) for one in registry.missing(day)]
        do_nights(registry, jobs, engine, report=lambda *_: None)
    judgements = {day: registry.judge(day) for day in DAYS}
    nights = registry.nights(DAYS[-1])
    fleet = {one.name: one for one in registry.machines()}
named = {one.machine: one for one in judgements[DAYS[-1]] if one.named}

# %% [markdown]
# ## Ten lines from file to figure
#
# A day of the lake (Parquet) is a frame, and a frame may stand where a log does.

# %%
minutes = pl.concat(Lake(str(FILES / "lake")).minutes("mill 4", DAYS[-1], 2))
log = minutes.select("minute_utc", pl.col("^.*_mean$").name.replace("_mean$", ""))
model = parse_model(fleet["mill 4"].model, name="mill 4")
ten_lines, axes = plt.subplots()
axes.plot(log["minute_utc"], simulate_log(model, log).outputs["Z_um"].displacement_um)
axes.plot(log["minute_utc"], log["probe_Z_um"], "o", color=ORANGE, markersize=3)
axes.set(ylabel="displacement [µm]", title="mill 4: model from temperatures alone, and touches")
_ = axes.tick_params(axis="x", rotation=15)

# %% [markdown]
# ## The morning

# %%
planted = {one.name: one for one in FLEET if one.fault is not None}
rows = []
for stored in nights:
    cause = ", ".join(named[stored.machine].causes) if stored.machine in named else ""
    truth = planted[stored.machine].fault if stored.machine in planted else ""
    moved, left = "–", "–"  # a sensor that gives one value: its model is compared with nothing
    for output in stored.result["outputs"].values():
        moved, left = f"{output['uncompensated_um']:.0f}", f"{output['rmse_um']:.1f}"
    rows.append((stored.machine, moved, left, cause, truth))
morning = table(("machine", "moved µm", "model leaves µm RMS", "named for", "planted"), rows)
print(morning)
for one in named.values():
    print(f"{one.machine}, since {one.since}:", *(sentence_of(said) for said in one.evidence))

# %% [markdown]
# ## Why: what the sensors of the named machines show
#
# Raw minutes of the lake, from a day before the fault on.

# %%
slide, panels = plt.subplots(len(named), 1, figsize=(9.5, 2.9 * len(named)), squeeze=False)
for axes, (name, one) in zip(panels[:, 0], sorted(named.items()), strict=True):
    back = (DAYS[-1] - planted[name].since).days + 1 if name in planted else 1
    seen = pl.concat(Lake(str(FILES / "lake")).minutes(name, DAYS[-1], back))
    guilty = " ".join(said.place.channel for said in one.evidence)
    colours = iter((ORANGE, BLUE))
    for channel in [c.removesuffix("_mean") for c in seen.columns if c.endswith("_C_mean")]:
        colour, width = (next(colours), 1.4) if channel in guilty else (GREY, 0.8)
        values = seen[f"{channel}_mean"]
        axes.plot(seen["minute_utc"], values, color=colour, linewidth=width, label=channel)
    axes.axvline(one.since, color=DARK, linestyle=":", label="named since")
    axes.set(ylabel="°C", title=f"{name}: {one.causes[0].replace('_', ' ')}")
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 0.98), ncols=4, fontsize=9)
    axes.tick_params(axis="x", labelsize=9)

# %% [markdown]
# ## What it does not say
#
# - Two nights and six machines name what is plain: `benchmarks/fleet_decisions.py` says how often a
#   gain or a time constant is found, and how often a well machine is named, in fleets of hundreds.
# - A proposal is a proposal: nothing is written to a machine.
