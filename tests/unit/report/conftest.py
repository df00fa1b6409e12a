"""What the tests of charts and certificates share: a long run, and charts that are not drawn."""

import pytest

from tests.unit.report.builders import make_report, make_run
from thermaxis.report import PositioningReport, _style
from thermaxis.report.charts import _figures
from thermaxis.report.charts._figures import Chart
from thermaxis.report.thermal import _panels


@pytest.fixture(scope="session")
def hundred_cycles() -> PositioningReport:
    """Return a report on 16 targets and 100 cycles."""
    return make_report(make_run(16, 100))


_PICTURE = b"""<?xml version="1.0"?>
<svg xmlns="http://www.w3.org/2000/svg" width="9" height="9"></svg>"""


@pytest.fixture(autouse=True)
def _quickly_placed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let what one test draws be placed roughly; what several look at is laid out as for users."""
    monkeypatch.setattr(_style, "_settle", lambda figure: figure.set_layout_engine(None))


@pytest.fixture
def not_laid_out(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let charts be drawn but neither laid out nor saved, where something else is the subject."""
    for kind in (_figures, _panels):
        monkeypatch.setattr(kind, "svg_bytes", lambda _: _PICTURE)


@pytest.fixture
def no_charts(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let no chart be drawn: a certificate has its place alone."""
    monkeypatch.setattr(Chart, "svg", lambda *_, **__: _PICTURE)
