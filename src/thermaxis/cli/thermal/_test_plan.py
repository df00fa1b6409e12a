"""The actions `plan` and `places` of `thermal-test`, and what they print."""

import argparse
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from thermaxis import files, thermal
from thermaxis.cli._arguments import add_json, adder, count, positive_seconds
from thermaxis.cli._json import show
from thermaxis.cli._outputs import check_outputs
from thermaxis.cli._planned_test import reached_by
from thermaxis.cli._progress import Progress
from thermaxis.cli.thermal._thermal_logs import (
    add_log_options,
    check_twice,
    entries_of,
    logs_of,
    reading_codes,
)
from thermaxis.errors import require_count
from thermaxis.report.tables import Part, Table, Value, rows_of
from thermaxis.thermal import GainsPrior, HeatingConditions, ReachedTest, ThermalTestPlan

_SHIFT_S = 8.0 * 3600.0
_CUSTOMARY = {
    thermal.CustomaryTest.HEATING: "one source after another, no cooling",
    thermal.CustomaryTest.HEAT_AND_COOL: "one source after another, heat and cool",
    thermal.CustomaryTest.RANDOM: "switched at random (median of 100)",
}


def add_plan(plan: argparse.ArgumentParser) -> None:
    """Declare the arguments of `plan`."""
    add = adder(plan)
    add("--machine FILE", "what may be switched and what is known, TOML", Path, required=True)
    add("--duration TIME", "length of the test, such as 8h (default: 8h)", positive_seconds)
    add("-o, --output FILE", "the plan, JSON, for program and record --plan", Path)
    add(
        "--after LOG",
        "log of an earlier test: says what it has reached, and plans what to run next; may be"
        " given more than once",
        Path,
        many=True,
    )
    add("--seed N", "seed of the search (default: 1)", count("seed", 0))
    add_json(plan)
    add_log_options(plan)


def add_places(places: argparse.ArgumentParser) -> None:
    """Declare the arguments of `places`."""
    add = adder(places)
    add("logs LOG", "logs with all candidate places", Path, nargs="+")
    add("--output NAME", "displacement; more than one for a choice for all", many=True)
    add("--place NAME=PLUS[-MINUS]", "a candidate (default: every temperature)", many=True)
    add("--places N", "number of places wanted (default: 3)", count("number of places", 1))
    add_json(places)
    add_log_options(places)


def run_plan(arguments: argparse.Namespace) -> int:
    """Plan, show and write."""
    inputs = [arguments.machine, *arguments.after, arguments.mapping]
    outputs = [("--json", arguments.json), ("-o", arguments.output)]
    check_outputs([(name, path) for name, path in outputs if path is not None], inputs)
    conditions = files.read_heating_conditions(arguments.machine)
    prior = prior_beside(conditions, arguments.machine)
    reached = list[ReachedTest]()
    with Progress() as progress:
        progress("reading", 0, 0)
        entries = entries_of(arguments, arguments.after)
        check_twice(entries)
        logs = [entry.log for entry in entries]
        for log in logs:
            reached.append(reached_by(conditions, prior, log))
            prior = reached[-1].gains
            conditions = replace(conditions, noise=reached[-1].noise)
        plan = thermal.planned(
            conditions,
            prior,
            arguments.duration or _SHIFT_S,
            seed=1 if arguments.seed is None else arguments.seed,
            progress=lambda done, of: progress("searching", done, of),
        )
    if arguments.output is not None:
        files.write_thermal_test_plan(plan, arguments.output)
    said = [*_reached(reached), *describe_plan(plan), *([reading_codes(logs)] if logs else [])]
    show(said, arguments.json, [arguments.output] if arguments.output else [])
    return 0


def prior_beside(conditions: HeatingConditions, stated_in: Path) -> GainsPrior:
    """Return what conditions say is known; the model's file counts from theirs."""
    known = conditions.known
    model = None if known is None else files.read_model(stated_in.parent / known.model)
    return thermal.prior_of(conditions, model)


def _reached(reached: list[ReachedTest]) -> Iterator[Part]:
    yield Value("reached_um", [one.uncertainty_um for one in reached])
    for one in reached:
        noise = one.noise
        yield (
            f"reached: {one.uncertainty_um:.2g} um of displacement predicted in use, standard"
            f" deviation; noise {noise.reading_um:.2g} um, drift {noise.drift_um:.2g} um"
        )


def describe_plan(plan: ThermalTestPlan) -> list[Part]:
    """Return everything that a plan says, as terminal and JSON have it."""
    conditions, last = plan.conditions, plan.foreseen_um[-1]
    names, steps = tuple(conditions.sources), plan.steps
    wanted = "what each source does when it has settled"
    if conditions.wanted is thermal.Wanted.PREDICTION:
        wanted = "displacement predicted in use"
    hours = [(k + 1) * conditions.block_min / 60.0 for k in range(len(plan.blocks))]
    shown = sorted({len(hours) * k // 4 - 1 for k in (1, 2, 3, 4)} - {-1})
    course = ", ".join(f"after {hours[k]:.3g} h {plan.foreseen_um[k]:.3g} um" for k in shown)
    left = {"this plan": last} | {text: plan.customary_um[t] for t, text in _CUSTOMARY.items()}
    return [
        Value("duration_s", plan.duration_s),
        Value("wanted", conditions.wanted),
        Table(
            f"{plan.duration_s / 3600.0:.2f} h with {conditions.rest_min:g} min of rest:",
            rows_of(
                Value("begin_s", [s.begin_s for s in steps]),
                Value("duration_s", [s.duration_s for s in steps]),
                Value("", [s.begin_s / 3600.0 for s in steps], "from [h]", ".2f"),
                Value("", [s.duration_s / 60.0 for s in steps], "for [min]", ".0f"),
                *(
                    Value(f"levels.{name}", [s.levels[k] for s in steps], name, "g")
                    for k, name in enumerate(names)
                ),
            ),
            "steps",
        ),
        Value("hours", hours),
        Value("foreseen_um", plan.foreseen_um),
        f"foreseen of {wanted}, standard deviation: {course}",
        *_enough(plan),
        Table(
            "beside customary tests of the same length:",
            rows_of(
                Value("", [*left], "test"),
                Value("", [*left.values()], "left [um]", ".2f"),
            ),
            words=1,
        ),
        Value("customary_um", dict(plan.customary_um)),
        Table(
            "at the highest level when settled:",
            rows_of(
                Value("", names, "source"),
                Value("", plan.settled_um, "foreseen [um]", ".2g"),
            ),
            words=1,
        ),
        Value("settled_um", dict(zip(names, plan.settled_um, strict=True))),
    ]


def _enough(plan: ThermalTestPlan) -> Iterator[Part]:
    enough_um, enough_s = plan.conditions.enough_um, plan.enough_s
    yield Value("enough_s", enough_s)
    if enough_um is not None and enough_s is None:
        yield f"{enough_um:g} um are not reached: plan it longer, or with faster changes of level"
    elif enough_s is not None:
        yield f"{enough_um:g} um are enough: reached after {enough_s / 3600.0:.2f} h, rest included"


def run_places(arguments: argparse.Namespace) -> int:
    """Choose places and show what each is worth."""
    check_outputs([("--json", arguments.json)], [*arguments.logs, arguments.mapping])
    with Progress() as progress:
        progress("reading", 0, 0)
        logs = logs_of(arguments, arguments.logs)
        definitions = [thermal.parse_input(text) for text in arguments.place] or [
            thermal.InputDefinition(name, name, None)
            for name in logs[0].columns
            if logs[0].units[name] in thermal.TEMPERATURES
        ]
        require_count("--place", len(definitions), 1, 1000)
        progress("comparing", 0, 0)
        records = thermal.records_of(logs, definitions, arguments.output or ["Z_um"])
        names = [one.name for one in definitions]
        found = thermal.best_places(records.experiments, names, arguments.places or 3)
    show([*_places(found), reading_codes(logs)], arguments.json)
    return 0


def _places(found: thermal.PlacesResult) -> Iterator[Part]:
    best = found.best
    yield f"best {len(best.places)} of {len(found.every.places)}: {', '.join(best.places)}"
    yield Value("best", best.places)
    yield Table(
        f"free runs over parts held out, {found.compared} subsets compared:",
        rows_of(
            Value(
                "",
                [
                    "these places",
                    *(f"without {name}" for name in found.without),
                    "all places",
                    "median of all subsets",
                ],
                "with",
            ),
            Value(
                "",
                [best.error_um, *found.without.values(), found.every.error_um, found.median_um],
                "error [um]",
                ".2f",
            ),
        ),
        words=1,
    )
    yield Value("error_um", best.error_um)
    yield Value("without_um", dict(found.without))
    yield Value("every_um", found.every.error_um)
    yield Value("median_um", found.median_um)
    yield Value("compared", found.compared)
