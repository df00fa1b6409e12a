"""``make demo-fleet``, smaller: six machines and one night."""

import re

import pytest

from benchmarks import demo_fleet
from thermaxis.fleet import Lake, Registry, axis_trends

pytestmark = pytest.mark.system


def test_a_small_fleet_ends_by_itself_and_leaves_its_registry_and_its_lake(tmp_path, capsys):
    folder = tmp_path / "demo-fleet"
    demo_fleet.main([str(folder), "6", "--workers", "1", "--nights", "1"])
    last = capsys.readouterr().out.splitlines()[-1]
    found = re.fullmatch(r"named (\d) of 1 planted \(right cause (\d)\), (\d) false", last)
    assert found is not None
    assert found[1] == found[2] == "1"  # a sensor that gives one value
    with Registry(f"sqlite:///{folder / 'registry.db'}") as registry:
        (day,) = {night.day for night in registry.nights()}
        assert [len(one.causes) for one in registry.judgements(day)] == [1]
        assert registry.last_judged() == day
        names = [machine.name for machine in registry.machines()]
        assert [night.machine for night in registry.nights(day)] == names
        assert [one.axis for one in axis_trends(registry.axis_runs("mill 1"))] == ["X"]
        assert sum(part.height for part in Lake(registry.lake).minutes(names[-1], day)) == 1440
    for _ in range(2):  # also a folder with the registry of a real fleet
        with pytest.raises(SystemExit, match="other files"):
            demo_fleet.main([str(tmp_path), "6"])
        (tmp_path / "registry.db").touch()
    assert (folder / "registry.db").exists()
