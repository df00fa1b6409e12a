"""What the tests of charts and certificates share: a long run, and charts that are not drawn."""

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import Any

import pytest

from tests.unit.report.builders import make_report, make_run
from thermaxis.report import PositioningReport
from thermaxis.report.charts import _figures
from thermaxis.report.charts._figures import Chart
from thermaxis.report.thermal import _panels
from thermaxis.report.thermal._panels import ThermalChart

DrawnOnce = Callable[[], AbstractContextManager[None]]


@pytest.fixture(scope="session")
def hundred_cycles() -> PositioningReport:
    """Return a report on 16 targets and 100 cycles."""
    return make_report(make_run(16, 100))


@contextmanager
def remembered_charts() -> Iterator[None]:
    """Draw every chart once, as long as this lasts; a chart is told by its name."""
    with pytest.MonkeyPatch.context() as patch:
        for kind in (Chart, ThermalChart):
            drawn: dict[str, bytes] = {}

            def svg(
                chart: Any,
                *of: Any,
                draw: Any = kind.svg,
                drawn: dict[str, bytes] = drawn,
                **size: float,
            ) -> bytes:
                if chart.name not in drawn:
                    drawn[chart.name] = draw(chart, *of, **size)
                return drawn[chart.name]

            patch.setattr(kind, "svg", svg)
        yield


_PICTURE = b"""<?xml version="1.0"?>
<svg xmlns="http://www.w3.org/2000/svg" width="9" height="9"></svg>"""


@pytest.fixture
def not_laid_out(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let charts be drawn but neither laid out nor saved, where something else is the subject."""
    for kind in (_figures, _panels):
        monkeypatch.setattr(kind, "svg_bytes", lambda _: _PICTURE)


@pytest.fixture
def no_charts(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let no chart be drawn: a certificate has its place alone."""
    monkeypatch.setattr(Chart, "svg", lambda *_, **__: _PICTURE)


@pytest.fixture(scope="session")
def drawn_once() -> DrawnOnce:
    """Return what lets the files of one result share its charts: a PDF and a page."""
    return remembered_charts
