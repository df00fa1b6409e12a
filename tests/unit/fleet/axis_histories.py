"""Positioning runs of an axis over the years, whose figures are chosen."""

from collections.abc import Sequence
from dataclasses import replace
from datetime import UTC, datetime, timedelta

from thermaxis.codes import Message
from thermaxis.fleet import AxisRun
from thermaxis.positioning import Finding
from thermaxis.report import TrendFigure

U_UM = 0.4
"""Expanded uncertainty of every figure. [um]"""


def spread_at(position: float) -> Finding:
    """Return the finding that a target scatters."""
    values = {
        "target": 3,
        "position": position,
        "position_unit": "mm",
        "unit": "µm",
        "compared": Message("diagnosis-ratio", {"ratio": 2.0}),
        "std": 0.5,
    }
    return Finding("spread", 0.5, "µm", Message("finding-spread", values), None)


AXIS_RUN = AxisRun(
    machine="A",
    axis="X",
    name="2020.csv",
    sha256="2020",
    start=datetime(2020, 3, 2, 8, tzinfo=UTC),
    kind="linear",
    targets=11,
    first_target=0.0,
    last_target=300.0,
    cycles=5,
    air_c=20.0,
    measured={key: TrendFigure(5.0, U_UM) for key in ("B", "E", "R", "A")},
    drift_free={},
    findings=(spread_at(40.0),),
)


def history(b_um: Sequence[float], u_um: float | None = U_UM) -> list[AxisRun]:
    """Return a run a year with these B; the other figures stay the same."""
    return [
        replace(
            AXIS_RUN,
            name=f"{2020 + k}.csv",
            sha256=str(2020 + k),
            start=AXIS_RUN.start + k * timedelta(days=365.25),
            measured={**AXIS_RUN.measured, "B": TrendFigure(float(value), u_um)},
        )
        for k, value in enumerate(b_um)
    ]
