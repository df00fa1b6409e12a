"""What every database of a registry must hold; SQLite and PostgreSQL are both asked."""

import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from datetime import timedelta
from typing import Any

import pytest

from tests.unit.fleet.axis_histories import AXIS_RUN
from tests.unit.fleet.fleet_machines import GAIN, LAST, machine_of, model_of
from thermaxis import __version__
from thermaxis.codes import Message, Place
from thermaxis.errors import ConfigurationError, DataError
from thermaxis.files import parse_model
from thermaxis.fleet import (
    FleetMachine,
    NightOutcome,
    NightResult,
    ProposalState,
    Registry,
    Standing,
)

Made = Callable[[], Registry]
"""Opens the registry that a test has made."""


def result_of(machine: FleetMachine, minutes: int = 1440) -> NightResult:
    """Return a night."""
    return NightResult(
        machine=machine.name,
        day=LAST,
        model_sha256=machine.model_sha256,
        outcome=NightOutcome.UNVERIFIED,
        minutes=minutes,
    )


def proposing(machine: FleetMachine, times: float, days: int = 0, **found: Any) -> NightResult:
    """Return a night, so many days after the last one, that proposes a gain so many times."""
    usual: dict[str, Any] = {
        "day": LAST + timedelta(days=days),
        "outcome": NightOutcome.VERIFIED,
        "proposal": model_of(times * GAIN),
    }
    return replace(result_of(machine), **{**usual, **found})


def twenty() -> list[FleetMachine]:
    return [machine_of(f"M{k:02}") for k in range(20)]


class RegistryLaws:
    """Tests for a fixture `made`: a function that opens one and the same registry."""

    def test_machines_are_what_was_added_and_their_models_are_kept(self, made: Made) -> None:
        with made() as registry:
            one, other = machine_of("Lathe 3", T_spindle_C="T3_C"), machine_of("µ")
            assert registry.add(one, "first")
            assert registry.add(other, "first")
            assert registry.machines() == [one, other]
            better = machine_of("Lathe 3", 1.1 * GAIN)
            assert not registry.add(better, "warm days")
            assert not registry.add(one, "back")
            assert registry.machines(["Lathe 3"]) == [one]
            first, second = registry.models("Lathe 3")
            assert (first.sha256, first.parent_sha256, first.why) == (
                one.model_sha256,
                None,
                "first",
            )
            assert (second.sha256, second.parent_sha256) == (
                better.model_sha256,
                one.model_sha256,
            )
            with pytest.raises(ConfigurationError, match="Lathe 3"):
                registry.machines(["Lathe"])

    def test_a_night_is_stored_once_and_missing_until_then(self, made: Made) -> None:
        with made() as registry:
            machines = [machine_of(f"M{k}") for k in range(3)]
            for machine in machines:
                registry.add(machine, "first")
            assert registry.last_day() is None
            assert registry.missing(LAST) == machines
            assert registry.record(map(result_of, machines[:2])) == 2
            assert registry.record([result_of(one, 7) for one in machines]) == 1
            assert registry.missing(LAST) == []
            assert registry.missing(LAST + timedelta(days=1)) == machines
            nights = registry.nights(LAST)
            assert [(one.machine, one.result["minutes"]) for one in nights] == [
                *(("M0", 1440), ("M1", 1440)),
                ("M2", 7),
            ]
            assert {one.version for one in nights} == {__version__}
            assert registry.last_day() == LAST
            registry.add(machine_of("M0", 2.0), "another model has nights of its own")
            assert [one.name for one in registry.missing(LAST)] == ["M0"]
            assert registry.record([]) == 0
            other = [replace(result_of(machines[1]), day=LAST - timedelta(days=k)) for k in (1, 2)]
            assert registry.record(other) == 2  # nights of one machine that come at once

    def test_who_is_named_is_stored_by_day_and_judged_anew_not_doubled(self, made: Made) -> None:
        still = Message("log-stuck", {}, Place(channel="T_spindle_C"))
        with made() as registry:
            machines = twenty()
            for machine in machines:
                registry.add(machine, "first")
            registry.record(map(result_of, machines[1:]))
            registry.record([replace(result_of(machines[0]), sensors=(still,))])
            for _ in range(2):
                judged = registry.judge(LAST)
                assert [one.machine for one in judged if one.named] == ["M00"]
                assert registry.judgements(LAST) == judged[:1]
            registry.rename("M00", "Lathe 3")
            assert [one.machine for one in registry.judgements(LAST)] == ["Lathe 3"]
            assert registry.judge(LAST - timedelta(days=1)) == []
            assert registry.judgements(LAST - timedelta(days=1)) == []

    def test_a_night_that_has_seen_more_of_its_day_takes_the_place_of_one_that_has_not(
        self, made: Made
    ) -> None:
        with made() as registry:
            machine = machine_of("A")
            registry.add(machine, "first")
            for last_id, minutes, stored in ((600, 10, 1), (600, 11, 0), (900, 15, 1), (700, 9, 0)):
                late = replace(result_of(machine, minutes), last_id=last_id)
                assert registry.record([late]) == stored
            assert registry.seen(LAST) == {"A": 900}
            (night,) = registry.nights(LAST)
            assert night.result["minutes"] == 15

    @pytest.mark.proof
    def test_of_two_programs_at_once_each_night_is_stored_by_one(
        self, made: Made, url: str, password: str
    ) -> None:
        machines = twenty()
        with made() as registry:
            for machine in machines:
                registry.add(machine, "first")
        both = [
            subprocess.Popen(
                [sys.executable, "-m", __name__, url, password, minutes],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                text=True,
            )
            for minutes in ("1", "2")
        ]
        for one in both:
            assert one.stdout is not None
            one.stdout.readline()  # it is ready
        for one in both:
            assert one.stdin is not None
            one.stdin.write("go\n")
            one.stdin.flush()
        stored = [int(count) for one in both for count in one.communicate()[0].split()]
        with made() as registry:
            nights = registry.nights(LAST)
        assert (len(stored), sum(stored), len(nights)) == (40, 20, 20)
        assert {one.result["minutes"] for one in nights} <= {1, 2}

    def test_a_renamed_machine_keeps_what_is_stored_and_is_not_added_again(
        self, made: Made
    ) -> None:
        with made() as registry:
            one, other = machine_of("old"), machine_of("other")
            for machine in (one, other):
                registry.add(machine, "first")
            registry.record([proposing(one, 1.1)])
            assert not registry.rename("old", "new")
            assert not registry.rename("old", "new")  # said twice
            assert registry.machines() == [replace(one, name="new", formerly=("old",)), other]
            assert registry.machines(["old"]) == registry.machines(["new"])
            with pytest.raises(ConfigurationError, match="is called new by now"):
                registry.add(one, "by a script that does not know")
            assert [night.machine for night in registry.nights()] == ["new"]
            assert registry.decide("old", accepted=True, who="A", why="w").machine == "new"
            with pytest.raises(ConfigurationError, match="nobody"):
                registry.rename("nobody", "new")
            registry.rename("new", "third")
            registry.rename("third", "new")  # and back
            assert registry.machines(["new"])[0].formerly == ("old", "third")
            assert [model.why for model in registry.models("new")] == ["first"]

    def test_a_machine_under_two_names_becomes_one_and_nothing_counts_twice(
        self, made: Made
    ) -> None:
        with made() as registry:
            machines = [machine_of("A"), machine_of("B")]
            for machine in machines:
                registry.add(machine, "first")
            registry.record(map(result_of, machines))
            assert registry.rename("A", "B")
            assert registry.machines() == [replace(machines[1], formerly=("A",))]
            assert [one.machine for one in registry.nights(LAST)] == ["B"]
            assert [one.machine for one in registry.nights(machine="A")] == ["A"]
            assert registry.missing(LAST) == []
            with pytest.raises(ConfigurationError, match="is called B by now"):
                registry.add(machines[0], "again")
            registry.add(machine_of("C"), "first")
            with pytest.raises(ConfigurationError, match="is called B by now"):
                registry.rename("C", "A")
            assert registry.machines(["B"])[0].formerly == ("A",)

    def test_a_machine_stands_by_its_newest_night_and_its_open_proposal(self, made: Made) -> None:
        machine, other = machine_of("A"), machine_of("B")
        with made() as registry:
            for one in (machine, other):
                registry.add(one, "first")
            assert registry.standings() == [
                Standing("A", "mill", None, None, machine.model_sha256),
                Standing("B", "mill", None, None, other.model_sha256),
            ]
            last = proposing(machine, 1.2)
            registry.record([last, proposing(machine, 1.1, days=-1)])
            (stands,) = registry.standings("A")
            (newest,) = registry.nights(LAST)
            assert stands.night == newest
            assert stands.proposed_sha256 == registry.proposals("A")[0].sha256
            seen = registry.proposals("A")[1].sha256
            with pytest.raises(ConfigurationError, match="Nothing is proposed"):
                registry.decide("A", accepted=True, who="Anna", why="w", sha256=seen)
            seen = stands.proposed_sha256 or ""
            registry.decide("A", accepted=False, who="Anna", why="w", sha256=seen)
            assert registry.standings("A") == [replace(stands, proposed_sha256=None)]
            registry.add(machine_of("A", 3.0), "another model, for which nothing is proposed")
            assert registry.standings("A")[0].proposed_sha256 is None
            registry.add(machine, "back")
            assert registry.standings("A")[0].model_sha256 == machine.model_sha256

    def test_the_day_judged_last_is_told_whatever_comes_after_it(self, made: Made) -> None:
        day = timedelta(days=1)
        with made() as registry:
            registry.add(machine_of("A"), "first")
            assert registry.last_judged() is None
            for judged in (LAST, LAST, LAST - day):
                registry.judge(judged)
                assert registry.last_judged() == LAST
            registry.record([replace(result_of(machine_of("A")), day=LAST + day)])
            assert (registry.last_judged(), registry.last_day()) == (LAST, LAST + day)
            registry.judge(LAST + day)
            assert registry.last_judged() == LAST + day

    def test_a_proposal_is_stored_once_and_the_first_decision_stands(self, made: Made) -> None:
        machine, better = machine_of("A"), model_of(1.1 * GAIN)
        with made() as registry:
            registry.add(machine, "first")
            with pytest.raises(ConfigurationError, match="Nothing is proposed"):
                registry.decide("A", accepted=True, who="Anna", why="w")
            for days in (0, 1):
                registry.record([proposing(machine, 1.1, days)])
            (proposal,) = registry.proposals("A")
            assert proposal.accepted is None
            assert parse_model(proposal.content, name="A") == better
            assert proposal.parent_sha256 == machine.model_sha256
            decided = registry.decide("A", accepted=False, who="Anna", why="worn")
            assert registry.proposals("A") == [decided]
            assert (decided.accepted, decided.who, decided.why) == (False, "Anna", "worn")
            with pytest.raises(ConfigurationError, match="decided on already"):
                registry.decide("A", accepted=True, who="Jan", why="w")
            assert registry.machines() == [machine]
            registry.add(machine_of("A", 1.2 * GAIN), "another one")
            with pytest.raises(ConfigurationError, match="Nothing is proposed"):
                registry.decide("A", accepted=True, who="Jan", why="w")

    def test_only_what_the_newest_night_that_judged_proposes_waits_for_a_person(
        self, made: Made
    ) -> None:
        machine = machine_of("A")
        still = Message("log-stuck", {}, Place(channel="T_spindle_C"))
        verified = {"outcome": NightOutcome.VERIFIED, "proposal": None}
        with made() as registry:
            registry.add(machine, "first")

            def states(night: NightResult | None = None) -> list[str]:
                registry.record([night] if night else [])
                found = [str(one.state) for one in registry.proposals("A")]
                waits = registry.standings("A")[0].proposed_sha256
                assert (waits is not None) == ("open" in found)
                return found

            def decide(**words: bool) -> None:
                registry.decide("A", who="Anna", why="w", **words)

            assert states(proposing(machine, 1.1)) == ["open"]
            untouched = replace(result_of(machine), day=LAST + timedelta(days=1))
            assert states(untouched) == ["open"]
            assert states(proposing(machine, 1.2, 2)) == ["superseded", "open"]
            stuck = replace(untouched, day=LAST + timedelta(days=3), sensors=(still,))
            assert states(stuck) == ["superseded"] * 2
            with pytest.raises(ConfigurationError, match="Nothing is proposed"):
                decide(accepted=True)
            assert states(proposing(machine, 1.3, 4)) == ["superseded"] * 2 + ["open"]
            assert states(proposing(machine, 1.0, 5, **verified)) == ["superseded"] * 3
            assert states(proposing(machine, 1.3, 6)) == ["superseded"] * 2 + ["open"]
            decide(accepted=True)
            assert states(proposing(machine, 1.4, 7)) == [
                *["superseded"] * 2,
                *("accepted", "superseded"),
            ]
            with pytest.raises(ConfigurationError, match="decided on already"):
                decide(accepted=True)
            registry.withdraw("A", who="Anna", why="w")
            assert states()[-1] == "open"
            decide(accepted=False)
            assert states()[-1] == "rejected"

    def test_nothing_is_accepted_of_a_machine_that_is_named_for_a_sensor(self, made: Made) -> None:
        still = Message("log-stuck", {}, Place(channel="T_spindle_C"))
        with made() as registry:
            machines = twenty()
            for machine in machines:
                registry.add(machine, "first")
            registry.record(map(result_of, machines[1:]))
            registry.record([proposing(machines[0], 1.1, sensors=(still,))])
            registry.judge(LAST)
            with pytest.raises(ConfigurationError, match="named for a sensor"):
                registry.decide("M00", accepted=True, who="Anna", why="w")
            assert not registry.decide("M00", accepted=False, who="Anna", why="w").accepted

    def test_a_model_that_is_known_of_another_machine_alone_is_not_taken_for_ones_own(
        self, made: Made
    ) -> None:
        with made() as registry:
            for name, gain in (("A", 1.0), ("B", 2.0), ("C", 1.0)):
                registry.add(machine_of(name, gain), "first")
            with pytest.raises(ConfigurationError, match="of B alone"):
                registry.report("A", model_of(2.0))
            assert registry.machines(["A"]) == [machine_of("A", 1.0)]
            assert registry.report("B", model_of(3.0)) == machine_of("B", 2.0).model_sha256
            registry.rename("B", "A")
            assert registry.report("A", model_of(2.0)) == machine_of("A", 1.0).model_sha256

    def test_a_night_that_was_set_aside_is_missing_only_when_it_is_asked_for_again(
        self, made: Made
    ) -> None:
        machines = [machine_of("A"), machine_of("B")]
        with made() as registry:
            for machine in machines:
                registry.add(machine, "first")
            aside = replace(result_of(machines[0]), outcome=NightOutcome.SET_ASIDE)
            registry.record([aside, replace(result_of(machines[1]), last_id=1440)])
            assert registry.missing(LAST) == []
            assert registry.missing(LAST, again=True) == machines[:1]
            assert registry.record([replace(result_of(machines[0]), last_id=1440)]) == 1
            assert registry.missing(LAST, again=True) == []

    def test_a_positioning_run_is_stored_once_whatever_its_file(self, made: Made) -> None:
        other_axis = replace(AXIS_RUN, axis="Y", sha256="y")
        with made() as registry:
            registry.add(machine_of("A"), "first")
            registry.add(machine_of("B"), "first")
            assert registry.add_axis_run(other_axis)
            assert registry.add_axis_run(AXIS_RUN)
            assert not registry.add_axis_run(AXIS_RUN)
            assert not registry.add_axis_run(replace(AXIS_RUN, name="run.rtl", sha256="rtl"))
            assert registry.axis_runs("A") == [AXIS_RUN, other_axis]
            assert registry.axis_runs("B") == []
            assert registry.axis_runs("A", "y") == [other_axis]
            assert registry.axis_runs("B", "y") == []
            with pytest.raises(ConfigurationError, match="stored as a run of A"):
                registry.add_axis_run(replace(AXIS_RUN, machine="B"))
            with pytest.raises(ConfigurationError, match="A, B"):
                registry.add_axis_run(replace(AXIS_RUN, machine="C", sha256="c"))
            registry.rename("A", "B")
            later = replace(AXIS_RUN, start=AXIS_RUN.start + timedelta(days=9), sha256="later")
            assert registry.add_axis_run(later)  # its file states the former name
            assert not registry.add_axis_run(replace(AXIS_RUN, machine="B"))
            of_both = [replace(one, machine="B") for one in (AXIS_RUN, later, other_axis)]
            assert registry.axis_runs("A") == registry.axis_runs("B") == of_both

    @pytest.mark.parametrize("version", [1, 2])
    def test_a_registry_of_a_version_before_is_brought_to_this_one(
        self, made: Made, url: str, password: str, version: int
    ) -> None:
        with made() as registry:
            registry.add(machine_of("A"), "first")
            registry.record([result_of(machine_of("A"))])
            with registry._asked() as connection:
                for statement in (
                    *("DROP TABLE steps", "DROP TABLE formerly", "DROP TABLE axis_runs"),
                    "ALTER TABLE nights DROP COLUMN last_id",
                    *(["DROP TABLE decisions", "DROP TABLE proposals"] if version == 1 else []),
                    f"UPDATE registry SET value = '{version}' WHERE name = 'version'",  # noqa: S608 - a number
                ):
                    connection.exec_driver_sql(statement)
        with pytest.raises(ConfigurationError, match="fleet init"):
            made()
        with Registry.make(url, "lake", password) as registry:
            assert registry.proposals("A") == []
            assert registry.axis_runs("A") == []
            assert len(registry.nights(LAST)) == 1
            registry.record([proposing(machine_of("A"), 2.0, days=1)])
            registry.decide("A", accepted=True, who="Anna", why="w")
            (withdrawn,) = registry.withdraw("A", who="Jan", why="too cold")
            assert withdrawn.state is ProposalState.ACCEPTED
            assert registry.proposals()[0].withdrawn == ("Jan", "too cold")

    def test_a_registry_is_made_once_and_another_version_is_refused(
        self, made: Made, url: str, password: str
    ) -> None:
        with made() as registry:
            registry.add(machine_of("A"), "first")
        with pytest.raises(ConfigurationError, match="its lake is lake"):
            Registry.make(url, "elsewhere", password)
        with Registry.make(url, "elsewhere", password, move_lake=True) as registry:
            assert (registry.lake, len(registry.machines())) == ("elsewhere", 1)
            with registry._asked() as connection:
                connection.exec_driver_sql("UPDATE registry SET value = '99'"
                                           " WHERE name = 'version'")  # fmt: skip
        for open_it in (made, lambda: Registry.make(url, "elsewhere", password)):
            with pytest.raises(ConfigurationError, match="version 99"):
                open_it()

    def test_a_database_without_a_registry_is_said(self, made: Made, url: str, password: str):
        with made() as registry, registry._asked() as connection:
            connection.exec_driver_sql("DELETE FROM registry")
        with pytest.raises(DataError, match="no registry"):
            Registry(url, password)


def _coordinate() -> None:
    """Store a night of every machine as a program of its own, once it is told to."""
    with Registry(*sys.argv[1:3]) as registry:
        print("ready", flush=True)
        sys.stdin.readline()
        for one in twenty():
            print(registry.record([result_of(one, int(sys.argv[3]))]), flush=True)


if __name__ == "__main__":
    _coordinate()
