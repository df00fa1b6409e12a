"""Thermal: logs are dropped, a model is identified and verified, and taken along."""

import asyncio
import json
import math
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from typing import Any, Final, cast

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from thermaxis.app._rooms import (
    RESULTS,
    Along,
    Json,
    Kind,
    Room,
    RoomHost,
    along,
    file_stem,
    no_option,
    read_small,
    receive_files,
    shown_name,
    spoken_as,
    words_of,
)
from thermaxis.app._shelf import Entry, Shelf
from thermaxis.compensation import CompensationModel, Part
from thermaxis.files import read_model, read_thermal_mapping
from thermaxis.web import RefusedError, answer_json, object_of, spoken
from thermaxis.web.work import WorkFolder

LARGEST_BYTES: Final = 60_000_000
"""Largest log. [byte]"""
MOST_BYTES: Final = 400_000_000
"""Largest sum of the files. [byte]"""
MOST_ENTRIES: Final = 60
"""Logs, models and verifications together. [1]"""
MOST_NAMES: Final = 40
"""Most inputs, outputs or logs of one request. [1]"""
_BAD_REQUEST, _NO_ROOM = 400, 507
_EXTENSIONS = (".csv", ".txt", ".parquet", ".xlsx", ".mat", ".tdms")
_NAME = r"[^\x00-\x1f\x7f]{1,200}"
_MODEL, _SERIES, _SAVED = "model.json", "series.json", ".json"
_MAP, _STATED = "map.toml", "stated.toml"
_FILES: Final[Along] = {
    "map": ("--mapping", _MAP, 64_000),
    "stated": ("--mapping", _STATED, 64_000),
}
_IDENTIFY = ("method", "sample_time")
_EXPORT = ("dialect", "cycle_s", "limit", "rate", "plausible", "reference")
_KINDS: Final[Mapping[str, Kind]] = {
    "model": Kind(_MODEL),
    "series": Kind(_SERIES),
    "log": Kind(""),
    "plc": Kind("plc.zip"),
    "pdf": Kind("report.pdf", ("--report=report.pdf",)),
    "html": Kind("report.html", ("--report=report.html",)),
    "json": Kind(RESULTS),
}


class ThermalRoom(Room):
    """The routes of the room, opened by a program for one person."""

    largest_bytes: Final[Mapping[str, int]] = {"/thermal/log": LARGEST_BYTES}
    """Largest bodies by path, where they are larger than a usual request's. [byte]"""
    files: Final = tuple(f"/thermal/{kind}/" for kind in _KINDS if kind != "series")
    """Below these paths there are files."""

    def __init__(self, host: RoomHost) -> None:
        shelf = Shelf(
            host, longest_s=math.inf, most=MOST_ENTRIES, most_bytes=MOST_BYTES, sheds=False
        )
        super().__init__(host, "thermal", shelf, _KINDS)
        self._models = 0

    def routes(self) -> list[BaseRoute]:
        """Return the routes."""
        return [
            Route("/thermal", self.host.paged(self.page), methods=["GET"]),
            self.at("/bench", self._told),
            self.at("/progress", self.progress),
            self.at("/log", self._upload, "POST"),
            self.at("/join", self._join, "POST"),
            self.at("/identify", self._identify, "POST"),
            self.at("/verify", self._verify, "POST"),
            self.at("/compare", self._compare, "POST"),
            self.at("/export", self._export, "POST"),
            self.at("/remove", self._remove, "POST"),
            self.at("/{kind}/{id}", self.file),
        ]

    async def page(self, request: Request) -> Response:
        """Return the page."""
        return self.host.page(
            request,
            "thermal.html",
            page="thermal",
            megabytes=LARGEST_BYTES // 1_000_000,
            largest_bytes=LARGEST_BYTES,
            extensions=",".join((*_EXTENSIONS, _SAVED, ".toml")),
        )

    # ---- what is there -------------------------------------------------------------------------

    async def _told(self, request: Request) -> Response:
        entries, language = self.shelf.all_of(self.owner(request)), spoken(request)
        told = await asyncio.to_thread(lambda: [_shown(one, language) for one in entries])
        return answer_json({"entries": told})

    async def _remove(self, request: Request) -> Response:
        entry = self.found(request, (await object_of(request)).get("id"))
        await asyncio.to_thread(self.shelf.drop, entry.id)
        return await self._told(request)

    # ---- work ----------------------------------------------------------------------------------

    async def _upload(self, request: Request) -> Response:
        """Keep a log, if the command can read it, or a model that was saved before."""
        query = request.query_params
        stored, shown = stored_name(query.get("name", "")), shown_name(query.get("name", ""))
        others, _ = along(query, _FILES)
        async with self.work(request) as folder:
            file = folder.path / stored
            await receive_files(request, folder.path, stored, others, LARGEST_BYTES)
            if file.suffix != _SAVED:
                if _STATED in others:
                    await asyncio.to_thread(_state, folder.path, spoken(request))
                maps = [_MAP] if others else []
                return await self._taken(request, folder, file, shown, *maps)
            self._refuse_full(request)
            model = await asyncio.to_thread(read_small, read_model, file, shown, spoken(request))
            known = {one.name for one in self.shelf.all_of(self.owner(request))}
            name = _unused(file.stem, known)
            file.rename(folder.path / _MODEL)
            entry = Entry(self.owner(request), "model", name, (), folder, {}, _told_of(model))
            return answer_json({"id": self.keep(entry).id})

    async def _taken(
        self, request: Request, folder: WorkFolder, log: Path, name: str, *maps: str
    ) -> Response:
        """Look at a log, and keep it under a name that no other log has."""
        known = {Path(f).stem for one in self.shelf.all_of(self.owner(request)) for f in one.inputs}
        log = log.rename(log.with_stem(_unused(log.stem, known)))
        words = ("channels", log.name, *(f"--mapping={one}" for one in maps))
        inputs = {log.name: log, **{one: folder.path / one for one in maps}}
        entry = Entry(self.owner(request), "log", name, words, folder, inputs)
        return await self._made(request, entry, {_SERIES: "--series"})

    async def _join(self, request: Request) -> Response:
        """Join two logs by time, and keep what comes as one more."""
        asked = await object_of(request)
        first, second = logs = self._logs(request, asked, 2)
        words = ["merge", *_files_of(logs), *words_of(asked, ("shift",))]
        async with self.work(request) as folder:
            words += ["--output=joined.csv", "--json=-"]
            await self.ask(request, words, folder, inputs=_inputs_of(logs))
            name = f"{first.name} + {second.name}"
            return await self._taken(request, folder, folder.path / "joined.csv", name)

    async def _identify(self, request: Request) -> Response:
        asked = await object_of(request)
        today = self.host.utc().astimezone().date().isoformat()
        self._models += 1
        name, options = f"model-{self._models}", (*identify_words(asked), f"--date={today}")
        logs, files = self._logs(request, asked, 0), {_MODEL: "--model", _SERIES: "--series"}
        return await self._judged(request, ("model", "identify"), name, logs, files, options)

    async def _verify(self, request: Request) -> Response:
        asked = await object_of(request)
        logs, files = self._logs(request, asked, 0), {_SERIES: "--series"}
        of = [self._entry(request, asked.get("model"), "model"), *logs]
        title = ", ".join(one.name for one in logs)
        return await self._judged(request, ("verification", "verify"), title, of, files)

    async def _compare(self, request: Request) -> Response:
        asked = await object_of(request)
        (log,) = self._logs(request, asked, 1)
        models = [self._entry(request, one, "model") for one in _names_of(asked, "models")]
        of = [*models, log]
        return await self._judged(request, ("comparison", "compare"), log.name, of, {})

    async def _judged(
        self,
        request: Request,
        made: tuple[str, str],
        name: str,
        of: Sequence[Entry],
        files: Mapping[str, str],
        options: Sequence[str] = (),
    ) -> Response:
        """Keep what a command makes of entries: its kind, and the command's word."""
        async with self.work(request) as folder:
            (kind, word), owner = made, self.owner(request)
            words, ids = (word, *_files_of(of), *options), tuple(one.id for one in of)
            entry = Entry(owner, kind, name, words, folder, _inputs_of(of), made_of=ids)
            return await self._made(request, entry, files)

    async def _made(self, request: Request, entry: Entry, files: Mapping[str, str]) -> Response:
        """Run the command of an entry, and keep what it prints and writes, by file and option."""
        self._refuse_full(request)
        folder = entry.folder
        words = [*entry.words, *(f"{option}={file}" for file, option in files.items()), "--json=-"]
        inputs = {n: path for n, path in entry.inputs.items() if path.parent != folder.path}
        told = await self.ask(request, words, folder, inputs=inputs)
        own = [*(path for path in entry.inputs.values()), *(folder.path / file for file in files)]
        await asyncio.to_thread(
            folder.leave_only, [one for one in own if one.parent == folder.path]
        )
        return answer_json({"id": self.keep(entry._replace(told=told)).id})

    async def _export(self, request: Request) -> Response:
        """Make the folder of a block for a PLC, packed, and return what the command says of it."""
        asked = await object_of(request)
        model = self._entry(request, asked.get("model"), "model")
        words = ["export", *_files_of([model]), "--output=plc", *words_of(asked, _EXPORT)]
        async with self.work(request) as folder:
            inputs = _inputs_of([model])
            told = await self.ask(request, [*words, "--json=-"], folder, inputs=inputs)
            packed = folder.path / "plc.zip"
            await asyncio.to_thread(packed.replace, model.folder.path / packed.name)
        return answer_json(spoken_as(told, spoken(request)))

    # ---- what is asked for ---------------------------------------------------------------------

    def _refuse_full(self, request: Request) -> None:
        if self.shelf.is_full(self.owner(request)):
            raise RefusedError(_NO_ROOM, "thermal-full")

    def _entry(self, request: Request, key: object, kind: str) -> Entry:
        found = self.found(request, key or "")
        if found.kind != kind:
            raise no_option(kind)
        return found

    def _logs(self, request: Request, asked: Json, count: int) -> list[Entry]:
        """Return the logs that are asked for: so many, or any number."""
        found = [self._entry(request, key, "log") for key in _names_of(asked, "logs")]
        if not found or (count and len(found) != count):
            raise RefusedError(_BAD_REQUEST, "thermal-choose_logs")
        return found


def _shown(entry: Entry, language: str) -> Json:
    return {
        "id": entry.id,
        "kind": entry.kind,
        "name": entry.name,
        "has_series": (entry.folder.path / _SERIES).exists(),
        "made_of": entry.made_of,
        "told": spoken_as(entry.told, language),
    }


def _told_of(model: CompensationModel) -> Json:
    """Return of a saved model what an identification would have told of it."""

    def part_of(part: Part) -> Json:
        return {
            "input": part.name,
            "dc_gain": part.dc_gain_um_per_k,
            "direct_gain": part.direct_gain_um_per_k,
            "gains": [one.gain_um_per_k for one in part.sections],
            "time_constants_s": [one.time_constant_s for one in part.sections],
            "delay_s": part.delay_s,
        }

    figures, outputs = model.provenance.figures, dict[str, Json]()
    for one in model.outputs:
        fit = figures.get(f"{one.name}.fit_percent")
        parts = [part_of(part) for part in one.parts]
        outputs[one.name] = {"fit_percent": fit, "parts": parts, "warnings": []}
    seen = [log.sha256 for log in model.provenance.logs]
    return {"outputs": outputs, "warnings": list(model.warnings), "trained_on": seen}


def _state(folder: Path, language: str) -> None:
    """Write into the mapping of a log what the page states of it, which goes before."""
    if not (folder / _MAP).exists():
        (folder / _STATED).rename(folder / _MAP)
        return
    mapping, stated = (
        read_small(read_thermal_mapping, folder / one, one, language) for one in (_MAP, _STATED)
    )
    headings = {one.name: heading for heading, one in mapping.columns.items() if one.name}
    columns = dict(mapping.columns)
    for name, one in stated.columns.items():  # the page knows a column by its name in the log
        heading = headings.get(name, name)
        columns[heading] = replace(columns.get(heading, one), unit=one.unit)
    time = {
        "column": mapping.time_column,
        "unit": stated.time_unit or mapping.time_unit,
        "date_order": stated.date_order or mapping.date_order,
        "format": stated.time_format or mapping.time_format,
        "sample_time_s": mapping.sample_time_s,
    }
    toml = partial(json.dumps, ensure_ascii=False)
    tables = {"time": time, **{f"columns.{toml(one)}": asdict(columns[one]) for one in columns}}
    text = "".join(
        f"[{name}]\n"
        + "".join(f"{key} = {toml(one)}\n" for key, one in table.items() if one is not None)
        for name, table in tables.items()
    )
    (folder / _MAP).write_text(text, "utf-8")


def _inputs_of(entries: Sequence[Entry]) -> dict[str, Path]:
    """Return the files of logs and models, by the names that a command knows."""
    found: dict[str, Path] = {}
    for one in entries:
        model = {f"{one.name}.json": one.folder.path / _MODEL}
        found = {**(model if one.kind == "model" else one.inputs), **found}
    return found


def _files_of(entries: Sequence[Entry]) -> list[str]:
    """Return the words of a command that name models and logs, and the one mapping of these."""
    maps = {
        one.inputs[_MAP].read_bytes() if _MAP in one.inputs else b""
        for one in entries
        if one.kind == "log"
    }
    if len(maps) > 1:
        raise RefusedError(_BAD_REQUEST, "thermal-maps_differ")
    files = list(dict.fromkeys(name for one in entries for name in _inputs_of([one])))
    return [f"--mapping={_MAP}" if one == _MAP else one for one in files]


# ---- what is asked, as words of commands ---------------------------------------------------------


def identify_words(asked: Json) -> list[str]:
    """Return outputs, inputs and options of an identification."""
    words = [f"--output={one}" for one in _names_of(asked, "outputs")]
    for one in _list(asked, "inputs"):
        if not isinstance(one, dict):
            raise no_option("inputs")
        found = cast("Json", one)
        plus, minus = _text(found.get("plus"), "inputs"), found.get("minus") or ""
        if asked.get("choose") is True:
            chosen = [plus, _text(minus, "inputs")] if minus else [plus]
            words += [f"--candidates={one}" for one in chosen]
            continue
        name = _text(found.get("name") or plus, "inputs").replace("=", " ")
        less = f"-{_text(minus, 'inputs')}" if minus else ""
        words.append(f"--input={name}={plus}{less}")
    return [*dict.fromkeys(words), *words_of(asked, _IDENTIFY)]


def stored_name(given: str) -> str:
    """Return a name for an uploaded file that no command takes for an option."""
    suffix = Path(given).suffix
    plain = re.fullmatch(r"\.[A-Za-z0-9]{1,8}", suffix, re.ASCII) and suffix.lower()
    suffix = plain if plain and plain != ".toml" else ".csv"
    return f"{file_stem(given).strip('-') or 'log'}{suffix}"


def _unused(stem: str, known: Collection[str]) -> str:
    """Return a name, with a number behind it where it is used already."""
    number, found = 1, stem
    while found in known:
        number += 1
        found = f"{stem}-{number}"
    return found


def _names_of(asked: Json, key: str) -> list[str]:
    return list(dict.fromkeys(_text(one, key) for one in _list(asked, key)))


def _list(asked: Json, key: str) -> list[Any]:
    found = asked.get(key, [])
    if not isinstance(found, list) or len(cast("list[Any]", found)) > MOST_NAMES:
        raise no_option(key)
    return cast("list[Any]", found)


def _text(value: object, key: str) -> str:
    if not isinstance(value, str) or not re.fullmatch(_NAME, value):
        raise no_option(key)
    return value
