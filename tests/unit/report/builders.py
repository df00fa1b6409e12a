"""Made-up runs, and reports on them."""

from collections.abc import Mapping
from dataclasses import replace
from datetime import datetime
from html.parser import HTMLParser
from typing import Any

import numpy as np

from thermaxis.codes import Message
from thermaxis.files import FigureLimits
from thermaxis.positioning import (
    FigureUncertainty,
    Iso230_2Result,
    PositioningTest,
    StartEnd,
    TimeSource,
    UncertaintyResult,
    check_test_conditions,
    evaluate_adjacent_difference,
    evaluate_against_cycles,
    evaluate_iso230_2,
)
from thermaxis.quantities import AxisKind
from thermaxis.report import LimitsCheck, PositioningReport, check_limits

HEADER = {
    "machine": "Frézka FNG 32",
    "axis": "X",
    "title": "Přejímka po opravě: příliš žluťoučký kůň",
    "serial_number": "12-345",
}


def make_run(
    targets: int = 9,
    cycles: int = 5,
    *,
    length: float = 300.0,
    kind: AxisKind = AxisKind.LINEAR,
    approaches: str = "both",
    seed: int = 1,
    times: bool = True,
    decimals: int = 2,
) -> PositioningTest:
    """Return a drifting run with a noisy third position; readings in acquisition order."""
    rng = np.random.default_rng(seed)
    step = length / (targets - 1)
    random_part = np.concatenate(([0.0], rng.uniform(-0.1, 0.1, targets - 2) * step, [0.0]))
    target = np.round(np.linspace(0.0, length, targets) + random_part, 3)
    share = (target / length)[:, None, None]
    cycle = np.arange(cycles)[None, :, None]
    drift = 6.0 * (1.0 - np.exp(-cycle / 12.0)) - 9.0 * (1.0 - np.exp(-cycle / 60.0))
    deviation = 4.0 * np.sin(5.0 * share) + drift * (0.4 + share)
    deviation = deviation + rng.normal(0.0, 0.35, (targets, cycles, 2))
    deviation[2] += rng.normal(0.0, 0.8, (cycles, 2))
    deviation[:, :, 1] -= 3.0
    deviation = np.round(deviation, decimals)
    if approaches != "both":
        deviation[:, :, 1 if approaches == "forward" else 0] = np.nan
    order = np.empty(deviation.shape)
    for j in range(cycles):
        order[:, j, 0] = 2 * targets * j + 1 + np.arange(targets)
        order[:, j, 1] = 2 * targets * (j + 1) - np.arange(targets)
    return PositioningTest(
        kind=kind,
        target=target,
        deviation=deviation,
        time_source=TimeSource.FILE if times else TimeSource.NONE,
        time_s=8.0 * (order - 1.0) if times else None,
        order=order if times else None,
        start=datetime(2026, 3, 2, 7, 30) if times else None,  # noqa: DTZ001  files state no zone
        end=datetime(2026, 3, 2, 14, 31) if times else None,  # noqa: DTZ001  files state no zone
        header=HEADER,
        environment={"air_temperature_c": StartEnd(23.6, 24.4)},
    )


def stated_alone(limits: FigureLimits) -> UncertaintyResult:
    """Return the uncertainties that the limits state, and no others."""
    lacking = (Message("left_out-everything"),)
    nothing = FigureUncertainty({}, {}, {}, {}, (), lacking)
    return UncertaintyResult(nothing, None, {}, {}, 0, 0).with_stated(limits.expanded_uncertainty)


def check_stated(limits: FigureLimits, result: Iso230_2Result) -> LimitsCheck:
    return check_limits(limits, result, stated_alone(limits).measured)


def make_report(
    test: PositioningTest,
    *,
    limits: FigureLimits | None = None,
    full: bool = False,
    header: Mapping[str, str] | None = None,
    **fields: Any,
) -> PositioningReport:
    """Return everything that the command would evaluate from a run."""
    result = evaluate_iso230_2(test, full=full)
    conditions = check_test_conditions(test)
    made = PositioningReport(
        test=test,
        iso230_2=result,
        adjacent_difference=evaluate_adjacent_difference(test) if test.target.size > 1 else None,
        against_cycles=evaluate_against_cycles(test) if test.cycles > 1 else None,
        other_standard=None,
        warnings=(*test.remarks, *conditions),
        header={**test.header, **(header or {})},
        limits=None if limits is None else check_stated(limits, result),
        uncertainty=None if limits is None else stated_alone(limits),
        source_name="x_axis.csv",
        source_sha256="0123456789abcdef" * 4,
        version="1.2.3",
        conditions=conditions,
    )
    return replace(made, **fields)


class PageReader(HTMLParser):
    """Collects what a browser would act on, and what it would show."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.tags: set[str] = set()
        self.attributes: list[tuple[str, str]] = []
        self.identifiers: list[str] = []
        self.text = ""
        self.feed(page)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.add(tag)
        self.attributes += [(name, value or "") for name, value in attrs]
        self.identifiers += [value or "" for name, value in attrs if name == "id"]

    def handle_data(self, data: str) -> None:
        self.text += data
