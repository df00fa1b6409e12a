"""A model is learnt from a machine's touches, accepted while the loop runs, and taken back."""

import asyncio
import json
from collections.abc import Generator
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from itertools import pairwise
from pathlib import Path

import pytest

from tests.system.loop_stand import NODES
from tests.system.programs import recorded_cycles
from tests.system.screen.stand import CYCLE_S, LARGEST_UM, RATE_UM_PER_S, Rig, wait_until
from tests.unit.cli.test_relearn import STEP_S, records
from tests.unit.runtime.machine_files import model
from thermaxis.cli import main
from thermaxis.files import write_model
from thermaxis.runtime import SystemClock, read_machine
from thermaxis.runtime.history import SqlHistorian

pytestmark = pytest.mark.system
ROWS = 24 * 3600 // STEP_S
"""A day of production that ends now; its touches lie ten minutes apart. [1]"""
TOUCHES = f"""\
node = "{NODES}touch_um"
counter_node = "{NODES}touch_count"
largest_um = 20.0
largest_rate_um_per_s = 0.5
"""


@pytest.fixture
def rig(tmp_path: Path) -> Generator[Rig]:
    """Yield a machine with a day of history, whose model is too fast."""
    rig = Rig(tmp_path)
    text = rig.configuration.read_text("utf-8").replace(f'node = "{NODES}Z_um"\n', TOUCHES)
    text = text.replace("[supervisor]\n", "[supervisor]\nask_enables = true\n")
    rig.configuration.write_text(text, encoding="utf-8")
    cold = {"T_spindle_C": 18.6, "T_column_C": 20.5}
    quick = replace(model(), reference="stated", reference_c=cold)
    write_model(quick, tmp_path / "models" / "quick.json")
    asyncio.run(_remember(rig.configuration))
    with rig:
        yield rig


async def _remember(configuration: Path) -> None:
    historian = SqlHistorian(read_machine(configuration).historian, SystemClock(), beside=False)
    await historian.open(("Z_um",))
    for one in records(ROWS, datetime.now(UTC) - timedelta(seconds=STEP_S * ROWS), every=2):
        historian.record(one)
    await historian.close(30.0)


def test_a_proposal_is_accepted_while_the_loop_runs_and_the_old_model_comes_back(
    rig: Rig, capsys: pytest.CaptureFixture[str]
) -> None:
    def relearnt(*words: str) -> str:
        assert main(["relearn", str(rig.configuration), *words]) == 0
        return capsys.readouterr().out

    people = {name: rig.visitor() for name in ("operator", "engineer")}
    for name, visitor in people.items():
        assert visitor.log_in(name).status == 200
    people["operator"].enable()
    told = json.loads(relearnt("--last", "1d", "--judge", "8h", "--json", "-"))
    proposal, proposed = f"{Path(told['proposal']).stem}.proposal", told["proposal"]
    wait_until("the correction acts", lambda: rig.offset_um() < -15.0)

    assert f"{proposed} accepted" in relearnt("--accept", proposal)
    assert "quick.json accepted" in relearnt("--rollback"), "at once"
    refused = people["operator"].ask("/ask", {"method": "ChooseModel", "arguments": [proposed]})
    assert refused.status == 403
    assert people["engineer"].request("ChooseModel", proposed)["answer"] == "accepted"
    rig.wait_cycles(2)
    assert "quick.json accepted" in relearnt("--rollback")
    rig.wait_cycles(8)

    cycles = [one for one in recorded_cycles(rig.folder / "history.db") if one.written]
    assert len(cycles) > 8
    for before, after in pairwise(cycles):
        moved_um = abs(after.correction_um[0] - before.correction_um[0])
        longest_s = max(after.monotonic_s - before.monotonic_s, CYCLE_S)
        assert moved_um <= RATE_UM_PER_S * longest_s + 2e-3  # recorded in nanometres
        assert abs(after.correction_um[0]) <= LARGEST_UM
