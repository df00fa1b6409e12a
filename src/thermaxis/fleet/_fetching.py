"""Bring what a person has accepted to a machine's folder of models, and take back what not.

It runs on the machine's computer. Nothing is chosen: that is done at the machine, by request and
role, as for any other model. What lies in the folder by it is called ``fetched-HASH``.
"""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import final

from thermaxis import __version__
from thermaxis.codes import Message, Place
from thermaxis.errors import ConfigurationError, ThermaxisError
from thermaxis.files import model_sha256, parse_model, write_model
from thermaxis.fleet._registry import Registry, StoredProposal
from thermaxis.runtime import (
    PROPOSAL_SUFFIX,
    MachineConfiguration,
    ModelFile,
    choosable_name,
    model_folder,
    model_in_force,
    write_proposal,
)
from thermaxis.runtime.config import read_model_file


@final
@dataclass(frozen=True, slots=True)
class Fetch:
    """What was fetched."""

    machine: str
    """Name of the machine in the registry."""
    model_sha256: str
    """Hash of the model that it has in force."""
    known_before: str | None
    """Hash of another one that the registry knew until then; None where it knew that."""
    model: str | None
    """Name of the accepted model in the folder of models; None where there is none to fetch."""
    written: bool
    """Whether it was written now; else it was there."""
    removed: tuple[str, ...]
    """Names of models that were withdrawn and are removed now."""
    remarks: tuple[Message, ...]
    """Withdrawn models that cannot be removed, as the machine still needs them; an accepted one
    that was compared with another than the one in force, and is not brought."""


def fetch(configuration: MachineConfiguration, registry: Registry) -> Fetch:
    """Bring the accepted model of a machine into its folder of models, and remove withdrawn ones.

    The registry learns which model the machine has in force. Ended at any time and called again
    it goes on: a model is in the folder whole or not at all.

    Not protected: who may write to the registry decides what may be chosen here.

    Parameters
    ----------
    configuration : MachineConfiguration
        The machine.
    registry : Registry
        The registry.

    Returns
    -------
    Fetch
        What was done.

    Raises
    ------
    ConfigurationError
        If the registry does not know the machine, or what it has in force as another one's alone,
        the machine has no folder of models, or the model is not the one that was accepted or does
        not fit the machine.
    """
    folder, known = model_folder(configuration), model_in_force(configuration)
    (machine,) = registry.machines([configuration.name])
    name = machine.name
    before = registry.report(name, known.model)
    wanted = registry.to_fetch(name)
    withdrawn = {one.sha256: one for one in registry.proposals(name) if one.withdrawn}
    if wanted is not None:
        withdrawn.pop(wanted.sha256, None)
    needed = {
        configuration.model.sha256: "withdrawn_configured",
        known.sha256: "withdrawn_in_force",
    }
    removed: list[str] = []
    remarks: list[Message] = []
    for sha256 in withdrawn:
        path = _path(folder, sha256)
        if sha256 in needed:
            remarks.append(Message(f"remark-{needed[sha256]}", place=Place(path.name)))
        elif path.exists():
            path.unlink()
            path.with_suffix(PROPOSAL_SUFFIX).unlink(missing_ok=True)
            removed.append(path.name)
    if wanted is not None and wanted.parent_sha256 != known.sha256:
        place = Place(_path(folder, wanted.sha256).name)
        remarks.append(Message("remark-proposal_of_other_model", place=place))
        wanted = None
    written = wanted is not None and _brought(configuration, wanted, known, registry)
    if wanted is not None and not _is_there(_path(folder, wanted.sha256), wanted.sha256):
        wanted = None  # it was withdrawn meanwhile
    model = None if wanted is None else _path(folder, wanted.sha256).name
    rest = model, written, tuple(removed), tuple(remarks)
    return Fetch(name, known.sha256, before, *rest)


def _path(folder: Path, sha256: str) -> Path:
    return folder / f"fetched-{sha256[:12]}.json"


def _is_there(path: Path, sha256: str) -> bool:
    """Return whether a folder has a model with its proposal: both whole, or it is done again."""
    try:
        found = path.with_suffix(PROPOSAL_SUFFIX).is_file() and read_model_file(path)
    except ThermaxisError:
        return False
    return bool(found) and found.sha256 == sha256


def _brought(
    configuration: MachineConfiguration,
    wanted: StoredProposal,
    known: ModelFile,
    registry: Registry,
) -> bool:
    """Write an accepted model and what it is, unless they are there; the model last."""
    folder = model_folder(configuration)
    path = _path(folder, wanted.sha256)
    model = parse_model(wanted.content, name=path.name)
    if model_sha256(model) != wanted.sha256:
        raise ConfigurationError("hash_mismatch", file=path.name, key="sha256")
    try:
        configuration.rules.applied_to(model)
    except ConfigurationError as error:  # it does not fit the machine
        place = error.place._replace(file=path.name)
        raise ConfigurationError.of(replace(error.message, place=place)) from error
    if not registry.fetched(wanted.machine, wanted.sha256) or _is_there(path, wanted.sha256):
        return False
    told = {
        "machine": configuration.name,
        "parent_sha256": known.sha256,
        "parent": choosable_name(folder, known),
        "proposal": path.name,
        "proposal_sha256": wanted.sha256,
        "program": f"thermaxis {__version__}",
        "who": wanted.who,
        "why": wanted.why,
    }
    write_proposal(path, told)
    write_model(model, path)
    return True
