"""Learn the model of a machine anew from its history, and propose it if newer touches say so.

The touches of the last days are learnt from, but for the newest ones: on these the model in force
and others are compared. What is clearly better is written beside the machine's models as a
proposal; nothing is changed. A person chooses it on the page of models, or by `--accept`; what was
in force before comes back by `--rollback`.
"""

import argparse
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

from thermaxis import __version__, thermal
from thermaxis.cli._arguments import add_json, adder, positive_seconds, refuse_foreign
from thermaxis.cli._json import show
from thermaxis.codes import message_as_json
from thermaxis.compensation import CompensationModel, Provenance, RequestKind, TrainingLog
from thermaxis.errors import ConfigurationError
from thermaxis.files import write_model
from thermaxis.files.settings import read_json_object
from thermaxis.messages import sentence_of, text_of
from thermaxis.report.tables import Part, Table, Value, as_json
from thermaxis.runtime import (
    PROPOSAL_SUFFIX,
    MachineConfiguration,
    ModelFile,
    choosable_name,
    history,
    model_folder,
    model_in_force,
    read_machine,
    write_proposal,
)
from thermaxis.runtime.config import read_model_file
from thermaxis.runtime.host import ask_loop

_DAY_S = 86_400.0
_LARGEST_BYTES = 1_000_000


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    add = adder(parser)
    add("configuration MACHINE.toml", "the machine, with a history and a folder of models", Path)
    add("--last TIME", "days that are looked at (default: 14d)", positive_seconds)
    add("--judge TIME", "the newest of them, that judge (default: 2d)", positive_seconds)
    add_json(parser)
    add("--accept PROPOSAL", "ask the running loop for a proposed model, and do no more", Path)
    add("--rollback", "ask it for what was in force before that, and do no more", bool)


def run(arguments: argparse.Namespace) -> int:
    """Learn and propose, or ask for another model."""
    configuration = read_machine(arguments.configuration)
    if arguments.accept is not None or arguments.rollback:
        what = "a look at the history"
        refuse_foreign(arguments, what, "--last", "--judge", "--json")
        if arguments.accept is not None and arguments.rollback:
            raise ConfigurationError(
                "options_exclude", key="--rollback", one="--accept", other="--rollback"
            )
        return _ask(configuration, arguments.accept)
    folder = model_folder(configuration)
    known = model_in_force(configuration)
    historian = configuration.historian
    with history.HistoryReader(historian.url, historian.password.reveal()) as reader:
        ends = reader.span()
        last = datetime.now(UTC) if ends is None else ends[1] + timedelta(microseconds=1)
        first = last - timedelta(seconds=arguments.last or 14.0 * _DAY_S)
        log = reader.retried(
            lambda: history.touched_log(reader.cycles(first, last), known.model, reader.where)
        )
    options = thermal.RelearnOptions(
        judged_s=arguments.judge or 2.0 * _DAY_S, filters=configuration.compensation.touches
    )
    found = thermal.relearn(log, known.model, options)
    judged = last - timedelta(seconds=options.judged_s)
    written: list[Path] = []
    if found.model is not None:
        when = f"{last.astimezone(UTC):%Y%m%d-%H%M}"
        path = folder / f"relearnt-{when}-{known.sha256[:8]}.json"  # never that of its parent
        write_model(_with_origin(found.model, known, log, judged), path)
        written = [path, path.with_suffix(PROPOSAL_SUFFIX)]
    parent = choosable_name(folder, known) if written else None
    times = (first, judged, last)
    parts = list(_described(configuration, found, (known.sha256, parent), times, written))
    if written:
        write_proposal(written[0], as_json(parts))
    show(parts, arguments.json, written)
    return 0


def _with_origin(
    model: CompensationModel, known: ModelFile, log: thermal.ThermalLog, judged: datetime
) -> CompensationModel:
    """Return a model that says where it comes from."""
    origin = Provenance(
        method=f"relearnt from {known.path.name}, {known.sha256}"[:2000],
        program=f"thermaxis {__version__}",
        date=f"{judged:%Y-%m-%d}",
        logs=(*known.model.provenance.logs, TrainingLog(log.where[-200:], "", log.rows)),
    )
    return replace(model, provenance=origin)


def _described(
    configuration: MachineConfiguration,
    found: thermal.Proposal,
    parent: tuple[str, str | None],
    times: tuple[datetime, datetime, datetime],
    written: Sequence[Path],
) -> Iterator[Part]:
    """Yield what was found, for terminal, JSON and proposal."""
    said = [f"{one.name}: {text_of(one.why)}" for one in found.outputs]
    yield Value("machine", configuration.name)
    yield Value("parent_sha256", parent[0])
    yield Value("parent", parent[1])
    for key, when in zip(("from", "judged_from", "to"), times, strict=True):
        yield Value(key, when.isoformat(timespec="seconds"))
    sha256 = None if not written else read_model_file(written[0]).sha256
    yield Value("proposal", written[0].name if written else None)
    yield Value("proposal_sha256", sha256)
    yield Value("program", f"thermaxis {__version__}")
    yield from said
    yield Table("", [_output(one) for one in found.outputs], key="outputs")
    rows = [
        [
            Value("", one.name, "output"),
            Value("", _learnt(c), "learnt from"),
            Value("", c.comparison.old_um, "in force um", ".2f"),
            Value("", c.comparison.new_um, "this one um", ".2f"),
            Value("", c.free_run_um[0], "free run um", ".2f"),
            Value("", c.free_run_um[1], "this one um", ".2f"),
            Value("", "proposed" if c is one.taken else "better" if c.better else "", ""),
        ]
        for one in found.outputs
        for c in one.candidates
    ]
    if rows:
        title = "What the newest touches add (innovations), and the free run, RMS; proposed is the"
        yield Table(f"{title} better one to which they add least", rows, words=2)
    if written:
        yield (
            "Nothing is changed: choose it on the page of models, or"
            f" thermaxis relearn {configuration.path.name} --accept {written[1].name}"
        )


def _learnt(candidate: thermal.Candidate) -> str:
    if candidate.learnt_s is None:
        return "all, identified anew"
    return "all" if candidate.learnt_s == float("inf") else f"{candidate.learnt_s / _DAY_S:g} d"


def _output(one: thermal.RelearnedOutput) -> list[Value]:
    candidates = [
        {
            "learnt": _learnt(c),
            "share": c.comparison.share,
            "least_share": c.comparison.least_share,
            "blocks": c.comparison.blocks,
            "innovation_um": c.comparison.new_um,
            "innovation_in_force_um": c.comparison.old_um,
            "free_run_um": c.free_run_um[1],
            "free_run_in_force_um": c.free_run_um[0],
            "better": c.better,
            "proposed": c is one.taken,
        }
        for c in one.candidates
    ]
    return [
        Value("output", one.name),
        Value("touches_learnt", one.touches[0]),
        Value("touches_judged", one.touches[1]),
        Value("proposed", one.taken is not None),
        Value("why", text_of(one.why)),
        Value("why_code", message_as_json(one.why)),
        Value("candidates", candidates),
    ]


# ---- accepting, and going back ------------------------------------------------------------------


def _ask(configuration: MachineConfiguration, proposal: Path | None) -> int:
    """Ask the loop for the model of a proposal, or for the one before that in force."""
    folder, known = model_folder(configuration), model_in_force(configuration)
    if proposal is not None:
        path = folder / proposal.with_suffix(PROPOSAL_SUFFIX).name
        told = read_json_object(path, largest_bytes=_LARGEST_BYTES)
        name, sha256 = str(told.get("proposal")), told.get("proposal_sha256")
        if told.get("parent_sha256") != known.sha256:
            raise ConfigurationError("proposal_of_other_model", file=path.name)
    else:
        every = (
            read_json_object(path, largest_bytes=_LARGEST_BYTES)
            for path in sorted(folder.glob(f"*{PROPOSAL_SUFFIX}"))
        )
        told = next((one for one in every if one.get("proposal_sha256") == known.sha256), None)
        if told is None:
            raise ConfigurationError("nothing_to_roll_back", file=known.path.name)
        name, sha256 = str(told.get("parent")), told.get("parent_sha256")
    if read_model_file(configuration.find_model(name)).sha256 != sha256:
        raise ConfigurationError("hash_mismatch", file=name, key="sha256")
    answer = ask_loop(configuration.state_file, RequestKind.MODEL, name)
    for _ in range(50):  # by what the loop keeps the way back is found
        if not answer.accepted or model_in_force(configuration).sha256 == sha256:
            break
        time.sleep(0.1)
    said = "accepted" if answer.accepted else "refused"
    sys.stdout.write(f"{name} {said}: {sentence_of(answer.message)}\n")
    return 0 if answer.accepted else 1
