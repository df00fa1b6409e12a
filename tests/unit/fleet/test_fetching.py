"""What a person has accepted comes into the machine's folder of models, and goes from there."""

import json
from collections.abc import Sequence
from datetime import UTC, date, datetime
from pathlib import Path

import pytest

from tests.refusals import refused
from tests.unit.runtime.machine_files import machine_file, model
from thermaxis.cli import main
from thermaxis.cli.machine import relearn
from thermaxis.codes import Message
from thermaxis.compensation import CompensationModel, RequestKind, cycle_state
from thermaxis.errors import DataError
from thermaxis.files import format_model, model_sha256, write_model
from thermaxis.fleet import (
    Fetch,
    FleetMachine,
    NightOutcome,
    NightResult,
    ProposalState,
    Registry,
    fetch,
)
from thermaxis.runtime import SavedState, StateFile, read_machine
from thermaxis.runtime.host import LocalAnswer

NAME = "vertical lathe"
WHO = {"who": "Anna", "why": "cold days"}
FIRST, BETTER, THIRD = model(), model(gain=12.0), model(gain=13.0)


def file_of(one: CompensationModel) -> str:
    return f"fetched-{model_sha256(one)[:12]}.json"


@pytest.fixture
def machine(tmp_path: Path) -> Path:
    """Return the file of a machine that its registry knows."""
    url = f"sqlite:///{tmp_path / 'registry.db'}"
    with Registry.make(url, "lake") as registry:
        sha256 = model_sha256(FIRST)
        registry.add(FleetMachine(NAME, "lathe", format_model(FIRST), sha256), "first")
    return machine_file(tmp_path)


@pytest.fixture
def registry(machine: Path):
    with Registry(f"sqlite:///{machine.parent / 'registry.db'}") as found:
        yield found


def propose(registry: Registry, better: CompensationModel, parent: CompensationModel = FIRST):
    night = NightResult(
        machine=NAME,
        day=date(2026, 11, 20 + len(registry.nights())),
        model_sha256=model_sha256(parent),
        outcome=NightOutcome.VERIFIED,
        proposal=better,
    )
    registry.record([night])
    registry.decide(NAME, accepted=True, **WHO)


def choose(path: Path, name: str) -> None:
    """Leave the state of a loop that has a model of the folder in force."""
    machine = read_machine(path)
    compensation, sha256 = machine.other_model(name)
    saved = SavedState(datetime.now(UTC), 0.0, sha256, name, False, cycle_state(compensation))
    assert StateFile(machine.state_file).save(saved, compensation)


def fetched(path: Path, registry: Registry) -> Fetch:
    return fetch(read_machine(path), registry)


def models(path: Path) -> list[str]:
    return sorted(one.name for one in (path.parent / "models").iterdir())


def states(registry: Registry) -> list[ProposalState]:
    return [one.state for one in registry.proposals(NAME)]


def test_an_accepted_model_is_fetched_whole_once_and_chosen_by_who_may(
    machine: Path, registry: Registry, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert fetched(machine, registry).model is None
    before = machine.read_bytes()
    propose(registry, BETTER)
    found = fetched(machine, registry)
    assert (found.model, found.written, found.known_before) == (file_of(BETTER), True, None)
    assert states(registry) == [ProposalState.FETCHED]
    assert machine.read_bytes() == before
    proposal = (machine.parent / "models" / found.model).with_suffix(".proposal")
    told = json.loads(proposal.read_text())
    assert (told["parent"], told["who"]) == ("lathe.json", "Anna")
    again = fetched(machine, registry)
    assert (again.model, again.written) == (found.model, False)
    for damaged in (proposal.with_suffix(".json"), proposal):  # what is not whole is mended
        damaged.unlink()
        assert fetched(machine, registry).written
    asked: list[tuple[RequestKind, object]] = []

    def ask(_: Path, kind: RequestKind, name: object) -> LocalAnswer:
        asked.append((kind, name))
        return LocalAnswer(True, Message("answer-model_settles"))

    monkeypatch.setattr(relearn, "ask_loop", ask)
    for words in (["--accept", proposal.name], ["--rollback"]):
        assert main(["relearn", str(machine), *words]) == 0
        choose(machine, str(asked[-1][1]))
        fetched(machine, registry)
    assert asked == [(RequestKind.MODEL, found.model), (RequestKind.MODEL, "lathe.json")]


def test_the_registry_learns_from_a_fetch_which_model_is_in_force(
    machine: Path, registry: Registry
) -> None:
    propose(registry, BETTER)
    choose(machine, str(fetched(machine, registry).model))
    found = fetched(machine, registry)
    assert (found.known_before, found.model, found.remarks) == (model_sha256(FIRST), None, ())
    assert registry.machines()[0].model_sha256 == model_sha256(BETTER)
    assert [one.why for one in registry.models(NAME)] == ["first", "cold days"]
    assert states(registry) == [ProposalState.IN_FORCE]
    write_model(THIRD, machine.parent / "models" / "third.json")
    choose(machine, "third.json")
    assert fetched(machine, registry).known_before == model_sha256(BETTER)
    assert registry.models(NAME)[-1].why == "in force at the machine"


def test_what_was_compared_with_another_model_or_does_not_fit_is_not_fetched(
    machine: Path, registry: Registry
) -> None:
    propose(registry, BETTER)
    write_model(THIRD, machine.parent / "models" / "third.json")
    choose(machine, "third.json")
    before = models(machine)
    found = fetched(machine, registry)
    assert (found.model, [one.code for one in found.remarks]) == (
        None,
        ["remark-proposal_of_other_model"],
    )
    assert models(machine) == before
    assert registry.machines()[0].model_sha256 == model_sha256(THIRD)
    propose(registry, model("T_nobody_C", "T_column_C"), THIRD)
    with refused("entries_missing"):
        fetched(machine, registry)
    assert models(machine) == before


def test_what_is_withdrawn_is_not_fetched_and_goes_unless_it_is_needed(
    machine: Path, registry: Registry
) -> None:
    with refused("nothing_to_withdraw"):
        registry.withdraw(NAME, **WHO)
    own = models(machine)
    propose(registry, BETTER)
    (before,) = registry.withdraw(NAME, **WHO)
    assert before.state is ProposalState.ACCEPTED
    assert (fetched(machine, registry).model, models(machine)) == (None, own)
    for accepted in (True, False):
        with refused("proposal_withdrawn", name=NAME):
            registry.decide(NAME, accepted=accepted, **WHO)
    propose(registry, THIRD)
    name = str(fetched(machine, registry).model)
    (before,) = registry.withdraw(NAME, **WHO)
    assert before.state is ProposalState.FETCHED
    choose(machine, name)  # somebody was quicker
    (said,) = fetched(machine, registry).remarks
    assert said.code == "remark-withdrawn_in_force"
    assert name in models(machine)
    text = machine.read_text()
    machine.write_text(text.replace("models/lathe.json", f"models/{name}"))
    choose(machine, "lathe.json")
    (said,) = fetched(machine, registry).remarks
    assert said.code == "remark-withdrawn_configured"
    machine.write_text(text)
    choose(machine, "lathe.json")
    assert fetched(machine, registry).removed == (name,)
    assert models(machine) == own
    assert fetched(machine, registry).removed == ()


def test_the_model_before_is_fetched_after_a_rollback_and_the_other_goes(
    machine: Path, registry: Registry
) -> None:
    with refused("no_model_before"):
        registry.roll_back(NAME, **WHO)
    propose(registry, BETTER)
    choose(machine, str(fetched(machine, registry).model))
    fetched(machine, registry)
    for _ in range(2):  # said twice it is one
        assert registry.roll_back(NAME, **WHO).sha256 == model_sha256(FIRST)
        assert states(registry) == [ProposalState.WITHDRAWN, ProposalState.ACCEPTED]
    found = fetched(machine, registry)
    assert (found.model, len(found.remarks)) == (file_of(FIRST), 1)
    choose(machine, file_of(FIRST))
    found = fetched(machine, registry)
    assert (found.known_before, found.model) == (model_sha256(BETTER), None)
    assert found.removed == (file_of(BETTER),)
    assert states(registry) == [ProposalState.WITHDRAWN, ProposalState.IN_FORCE]
    write_model(BETTER, machine.parent / "models" / "by hand.json")
    choose(machine, "by hand.json")
    assert fetched(machine, registry).model is None
    again = {"who": "Eva", "why": "cold again"}
    assert registry.roll_back(NAME, **again).sha256 == model_sha256(FIRST)
    (_, back) = registry.proposals(NAME)
    assert (back.state, back.who) == (ProposalState.ACCEPTED, "Eva")
    with registry._asked() as connection:
        kept = connection.exec_driver_sql("SELECT step, who FROM steps ORDER BY id").all()
    assert {(step.partition(" until ")[0], who) for step, who in kept if "until" in step} == {
        *{("accepted", "Anna"), ("fetched", NAME), ("in_force", NAME)}
    }


def test_a_model_is_withdrawn_while_it_is_fetched(
    machine: Path, registry: Registry, monkeypatch: pytest.MonkeyPatch
) -> None:
    propose(registry, BETTER)
    own, look = models(machine), registry.to_fetch

    def late(name: str) -> object:
        found = look(name)
        if found is not None and found.state is ProposalState.ACCEPTED:
            registry.withdraw(NAME, **WHO)
        return found

    monkeypatch.setattr(Registry, "to_fetch", lambda _, name: late(name))
    assert (fetched(machine, registry).model, models(machine)) == (None, own)


def test_a_disk_that_is_full_leaves_nothing_that_could_be_chosen(
    machine: Path, registry: Registry, monkeypatch: pytest.MonkeyPatch
) -> None:
    propose(registry, BETTER)

    def full(*_: object) -> None:
        raise DataError("file_unwritable", cause="No space left on device")

    own = read_machine(machine).models_to_choose()
    with monkeypatch.context() as patch:
        patch.setattr("thermaxis.fleet._fetching.write_model", full)
        with pytest.raises(DataError):
            fetched(machine, registry)
    assert read_machine(machine).models_to_choose() == own
    assert fetched(machine, registry).written


def said(words: Sequence[str], capsys: pytest.CaptureFixture[str], code: int = 0) -> str:
    capsys.readouterr()
    assert main(["fleet", *words]) == code
    return capsys.readouterr().out


def test_the_commands_say_what_follows(
    machine: Path, registry: Registry, capsys: pytest.CaptureFixture[str]
) -> None:
    address = str(machine.parent / "registry.db")
    fetching = ["fetch", str(machine), address]
    decide = [address, NAME, "--who", "Anna", "--why", "cold days"]
    assert "no accepted model" in said(fetching, capsys)
    propose(registry, BETTER)
    shown = json.loads(said([*fetching, "--json", "-"], capsys))
    assert (shown["model"], shown["written"]) == (file_of(BETTER), True)
    assert f"--accept {Path(file_of(BETTER)).stem}.proposal" in said(fetching, capsys)
    choose(machine, file_of(BETTER))
    assert "in force; the registry knew" in said(fetching, capsys)
    assert "thermaxis fleet fetch brings it" in said(["rollback", *decide], capsys)
    assert "choose another one" in said(fetching, capsys, 1)
    assert "was fetched" in said(["withdraw", *decide], capsys)
    shown = json.loads(said(["machine", address, NAME, "--json", "-"], capsys))
    assert [one["state"] for one in shown["proposals"]] == ["withdrawn", "withdrawn"]
    assert shown["proposals"][0]["withdrawn"] == ["Anna", "cold days"]
    withdraw = [*said(["machine", address, NAME], capsys).split("Proposals")[1].split()]
    assert withdraw.count("Anna") == 2  # who has withdrawn them, and why
    assert withdraw.count("cold") == 2
