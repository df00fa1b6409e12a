"""What `thermaxis commission` has proven of touches: until then they are shown, and change nothing.

A file beside the state says what each output was proven with. Where the configuration says anything
else the proof is void, and so it is where the file cannot be read.

Not protected: a probe, a wire or a probing cycle that is changed behind the same nodes.
"""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

from thermaxis.runtime.config._configuration import MachineConfiguration


def unproven_touches(configuration: MachineConfiguration) -> tuple[str, ...]:
    """Return the outputs whose touches are to act on a machine, but are not proven."""
    kept, touches = _kept(configuration), configuration.rules.touches
    if configuration.sink.kind == "dry":
        return ()
    acting = (name for name, own in touches.items() if own.acts)
    return tuple(name for name in acting if kept.get(name) != _proven_with(configuration, name))


def with_proven_touches(configuration: MachineConfiguration) -> MachineConfiguration:
    """Return the configuration in which touches that are not proven are only shown."""
    touches = dict(configuration.rules.touches)
    for name in unproven_touches(configuration):
        touches[name] = replace(touches[name], acts=False)
    return replace(
        configuration,
        rules=replace(configuration.rules, touches=touches),
        compensation=replace(configuration.compensation, touches=touches),
    )


def keep_touch_proof(configuration: MachineConfiguration, output: str, *, proven: bool) -> None:
    """Keep with what touches of an output were proven, or that they are not."""
    kept = _kept(configuration)
    kept.pop(output, None)
    if proven:
        kept[output] = _proven_with(configuration, output)
    _file_of(configuration).write_text(f"{json.dumps(kept, indent=2)}\n", encoding="utf-8")


def _file_of(configuration: MachineConfiguration) -> Path:
    return configuration.state_file.with_suffix(".proofs")


def _kept(configuration: MachineConfiguration) -> dict[str, Any]:
    try:
        kept = json.loads(_file_of(configuration).read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return {}
    return cast("dict[str, Any]", kept) if isinstance(kept, dict) else {}


def _proven_with(configuration: MachineConfiguration, name: str) -> dict[str, Any]:
    """Return what sign and size of the touches at an output depend on."""
    source, sink = configuration.source, configuration.sink
    found: dict[str, Any] = {"machine": configuration.name}
    for key, one in (("source", source), ("sink", sink)):
        connection = configuration.connections.get(one.connection)
        found[key] = [one.kind, None if connection is None else connection.url]
    for key, table, names in (
        ("output", configuration.outputs, ("node", "joint", "unit", "sign")),
        ("probe", configuration.probes, ("node", "counter_node", "unit", "scale")),
    ):
        found[key] = [getattr(table.get(name), one, None) for one in names]
    return found
