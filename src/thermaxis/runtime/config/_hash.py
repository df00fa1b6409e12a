"""The hash by which loop and screen see whether they were started with the same configuration."""

import hashlib
import json
from dataclasses import fields, is_dataclass
from typing import TYPE_CHECKING, cast

from thermaxis.runtime.config._configuration import MachineConfiguration

if TYPE_CHECKING:
    from collections.abc import Mapping

_LATER = {"moves_with", "rests_k", "touches"}
"""Keys that count where they are stated: without them other versions have the same hash."""


def configuration_sha256(configuration: MachineConfiguration) -> str:
    """Return the hash of what a screen shows of a configuration, and the loop works by.

    Comments, order and places of files do not count; the model, which may be changed while the
    loop runs, has a hash of its own.

    Not protected: what is not in it may differ, such as the nodes of sensors and outputs, and
    where the history lies, which another computer names otherwise. Two versions of the program may
    understand one file differently, and then have two hashes: a status names its version too.

    It is the SHA-256 of JSON with keys in alphabetical order, no blanks, ASCII.
    """
    other = configuration.other_compensation
    content = {
        "machine": configuration.name,
        "rules": configuration.rules,
        "interlocks": {name: flag.value for name, flag in configuration.interlocks.items()},
        "other_compensation": None if other is None else other.value,
        "diameter_read": configuration.diameter is not None,
        "probes": sorted(configuration.probes),
    }
    text = json.dumps(content, sort_keys=True, separators=(",", ":"), default=_plain)
    return hashlib.sha256(text.encode("ascii")).hexdigest()


def _plain(value: object) -> object:
    """Return a frozen value as what json writes; the order of a set does not count."""
    if is_dataclass(value):
        told = {one.name: getattr(value, one.name) for one in fields(value)}
        return {key: one for key, one in told.items() if key not in _LATER or one}
    if isinstance(value, frozenset):
        return sorted(cast("frozenset[str]", value))
    return dict(cast("Mapping[str, object]", value))
