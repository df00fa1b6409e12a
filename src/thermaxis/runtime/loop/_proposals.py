"""Proposed models in the folder from which a person may choose: a model, and beside it what it is.

``NAME.json`` is the model, ``NAME.proposal`` says by name and hash what it is and which model it is
to replace. Whoever proposes, a look at the history or a fleet, writes both.
"""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Final

from thermaxis.errors import ConfigurationError
from thermaxis.files import write_model
from thermaxis.files.settings import write_document
from thermaxis.runtime.config import MachineConfiguration, ModelFile, read_model_file
from thermaxis.runtime.loop._saved_state import StateFile

PROPOSAL_SUFFIX: Final = ".proposal"
"""How the file beside a proposed model ends."""


def model_folder(configuration: MachineConfiguration) -> Path:
    """Return the folder from which a person may choose a model.

    Raises
    ------
    ConfigurationError
        If the machine has none.
    """
    if configuration.machine.model_folder is None:
        raise ConfigurationError(
            "no_model_folder", file=configuration.path, key="machine.model_folder"
        )
    return configuration.machine.model_folder


def model_in_force(configuration: MachineConfiguration) -> ModelFile:
    """Return the model that the loop has, or will begin with.

    Raises
    ------
    ConfigurationError
        If its file is gone, or was changed since it was chosen.
    """
    saved, _ = StateFile(configuration.state_file).load(configuration.compensation)
    if saved is None or saved.model_sha256 == configuration.model.sha256:
        return configuration.model
    found = read_model_file(configuration.find_model(saved.model_file))
    if found.sha256 != saved.model_sha256:
        raise ConfigurationError("hash_mismatch", file=found.path.name, key="sha256")
    return found


def choosable_name(folder: Path, known: ModelFile) -> str:
    """Return the name by which a model is chosen again; of a copy where it had none."""
    path, inside = known.path.resolve(), folder.resolve()
    if path.is_relative_to(inside):
        return str(path.relative_to(inside))
    copy = folder / f"before-{known.sha256[:8]}.json"
    write_model(known.model, copy)
    return copy.name


def write_proposal(model: Path, told: Mapping[str, object]) -> Path:
    """Write what a proposed model is beside its file, whole or not at all."""
    path = model.with_suffix(PROPOSAL_SUFFIX)
    write_document(json.dumps(told, indent=1, allow_nan=False) + "\n", path)
    return path
