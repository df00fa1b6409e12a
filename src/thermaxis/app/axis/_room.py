"""Axis: a measured run is dropped, figures come back, and everything that is made of it.

A run is stored under a name of ours; what it holds, and its name, are shown as text.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from thermaxis.app._rooms import (
    RESULTS,
    Along,
    Kind,
    Room,
    RoomHost,
    along,
    no_option,
    receive_files,
    shown_name,
    size_of,
    spoken_as,
    words_of,
)
from thermaxis.app._shelf import Entry, Shelf
from thermaxis.app.axis._forms import LARGEST_TABLE_BYTES, KeptForms, forms, judge, texts_of
from thermaxis.controls import control_names
from thermaxis.web import RefusedError, answer_json, spoken
from thermaxis.web.work import remove_leftovers

LARGEST_BYTES: Final = 20_000_000
"""Largest upload, the run with what goes along. [byte]"""
LARGEST_PLAN_BYTES: Final = 2_000_000
"""Largest plan. [byte]"""
MOST_RUNS: Final = 50
"""Runs of one trend. [1]"""
KEPT_S: Final = 3600.0
"""Time for which a result is kept. [s]"""
MOST_OF_A_PERSON: Final = 10
"""Results that one person keeps; the oldest goes. [1]"""
MOST_BYTES: Final = 400_000_000
"""Largest sum of what lies in the folders of all results; the oldest go. [byte]"""
_EXTENSIONS = (".rtl", ".csv", ".dat", ".xlsx", ".xls", ".md", ".txt")
_BAD_REQUEST = 400
_PLAN, _TABLE, _PROGRAM = "plan.json", "table.txt", "program.txt"

_OPTIONS = ("cycle", "edition", "reference_cycle", "reference_time")
_READING = ("decimal", "date_order", "units", "target_tolerance", "encoding")
"""How a file is read, for every command that reads it."""
_UNITS = ("mm,um", "mm,mm", "mm,nm", "m,um", "in,uin", "deg,arcsec", "deg,deg", "rad,urad")
"""Units of position and deviation that the page offers."""
_TABLE_OPTIONS = ("control", "axis", "points")
_PLAN_OPTIONS = ("length", "targets", "start", "axis", "pitch", "feed", "dwell", "cycles")
_PROGRAM_OPTIONS = ("control", "travel", "warm_up")
_FILES: Final[Along] = {
    "head": ("--header", "head.toml", LARGEST_TABLE_BYTES),
    "limits": ("--limits", "limits.toml", LARGEST_TABLE_BYTES),
    "budget": ("--budget", "budget.toml", LARGEST_TABLE_BYTES),
    "plan": ("--plan", _PLAN, LARGEST_PLAN_BYTES),
    "map": ("--map", "map.toml", LARGEST_TABLE_BYTES),
}
_MAP: Final[Along] = {"map": _FILES["map"]}
_REPORT_POLICY = (
    "default-src 'none'; style-src 'unsafe-inline'; img-src data:; form-action 'none';"
    " base-uri 'none'; frame-ancestors 'self'; sandbox"
)
_KINDS: Final[Mapping[str, Kind]] = {
    "report": Kind(
        "report.html", ("--report=report.html",), {"Content-Security-Policy": _REPORT_POLICY}
    ),
    "certificate": Kind("certificate.pdf", ("--report=certificate.pdf",)),
    "page": Kind("certificate.html", ("--report=certificate.html",)),
    "dcc": Kind("certificate.xml", ("--report=certificate.xml",)),
    "charts": Kind("charts.zip", ("--figures=charts",)),
    "csv": Kind("run.tidy.csv"),
    "run": Kind(""),
    "json": Kind(RESULTS),
}


class AxisRoom(Room):
    """The routes of the room, opened by a program."""

    largest_bytes: Final[Mapping[str, int]] = {
        "/positioning/upload": LARGEST_BYTES,
        "/positioning/trend": 3 * LARGEST_BYTES,
        "/positioning/program": LARGEST_PLAN_BYTES,
        "/positioning/toml": LARGEST_TABLE_BYTES,
    }
    """Largest bodies by path, where they are larger than a usual request's. [byte]"""
    files: Final = ("/positioning/",)
    """Below these paths there are files."""

    def __init__(self, host: RoomHost) -> None:
        shelf = Shelf(host, longest_s=KEPT_S, most=MOST_OF_A_PERSON, most_bytes=MOST_BYTES)
        super().__init__(host, "positioning", shelf, _KINDS)
        self._forms = KeptForms(host.settings)

    def routes(self) -> list[BaseRoute]:
        """Return the routes."""
        remove_leftovers()
        return [
            Route("/positioning", self.host.paged(self.page), methods=["GET"]),
            self.at("/results", self._results),
            self.at("/progress", self.progress),
            self.at("/upload", self._upload, "POST"),
            self.at("/trend", self._trend, "POST"),
            self.at("/toml", self._toml, "POST"),
            self.at("/form/{form}", self._form, "POST"),
            self.at("/plan", self._plan, "POST"),
            self.at("/program", self._program, "POST"),
            self.at("/table/{id}", self._table, "POST"),
            self.at("/result/{id}", self._result),
            self.at("/{kind}/{id}", self.file),
        ]

    async def page(self, request: Request) -> Response:
        """Return the page."""
        owner = self.host.owner_of(request)
        return self.host.page(
            request,
            "axis.html",
            page="positioning",
            may=owner is not None,
            extensions=",".join((*_EXTENSIONS, ".toml", ".json")),
            megabytes=LARGEST_BYTES // 1_000_000,
            largest_bytes=LARGEST_BYTES,
            limit_s=self.host.longest_s,
            most=MOST_OF_A_PERSON,
            forms=forms(),
            kept={} if owner is None else self._forms.of(owner.name),
            controls=control_names(),
            units=_UNITS,
        )

    async def _results(self, request: Request) -> Response:
        found = reversed(self.shelf.all_of(self.host.owner_of(request)))
        rows = [{"id": one.id, "name": one.name, "at": one.at_utc.isoformat()} for one in found]
        return answer_json({"results": rows})

    async def _result(self, request: Request) -> Response:
        return _shown(self.found(request), request)

    # ---- evaluation ----------------------------------------------------------------------------

    async def _upload(self, request: Request) -> Response:
        """Store the upload, run the command and keep what came."""
        query = request.query_params
        name = query.get("name", "")
        options = words_of(query, _OPTIONS, flags=("no_drift", "full"))
        reading = words_of(query, _READING)
        others, words = along(query, _FILES)
        stored, shown = stored_name(name), shown_name(name)
        today = self.host.utc().astimezone().date().isoformat()
        stated = (f"--date={today}", f"--source-name={shown}", *options, *words, *reading)
        told = ["evaluate", stored, "--json=-", *stated]
        reading += [word for word in words if word.startswith("--map")]
        async with self.work(request) as folder:
            await receive_files(request, folder.path, stored, others, LARGEST_BYTES)
            found = await self.ask(request, told, folder, names={stored: shown})
            owner, files = self.owner(request), {stored: folder.path / stored}
            made = Entry(owner, "run", shown, tuple(told), folder, files, found)
            result = self.keep(made._replace(reading=tuple(reading)))
        return _shown(result, request)

    def words_for(self, entry: Entry, kind: Kind) -> list[str]:
        """Return the words of the command that writes a file of a run."""
        if kind is _KINDS["csv"]:
            return ["convert", *entry.inputs, f"--output={kind.file}", *entry.reading]
        return super().words_for(entry, kind)

    async def _trend(self, request: Request) -> Response:
        """Return the trend of several runs, as its command prints it."""
        query = request.query_params
        names, sizes = query.getlist("name"), query.getlist("bytes")
        if not 2 <= len(names) == len(sizes) <= MOST_RUNS:
            raise RefusedError(_BAD_REQUEST, "positioning-runs_wrong", most=MOST_RUNS)
        stored = [f"{k}-{stored_name(name)}" for k, name in enumerate(names)]
        shown = {file: shown_name(name) for file, name in zip(stored, names, strict=True)}
        others = {
            file: size_of(size, "bytes", LARGEST_BYTES)
            for file, size in zip(stored[1:], sizes[1:], strict=True)
        }
        tables, given = along(query, _MAP)
        words = ["trend", *stored, "--json=-", *given, *words_of(query, _READING)]
        async with self.work(request) as folder:
            await receive_files(
                request, folder.path, stored[0], {**others, **tables}, 3 * LARGEST_BYTES
            )
            found = await self.ask(request, words, folder, names=shown)
        return answer_json(spoken_as(found, spoken(request)))

    # ---- tables and plans ----------------------------------------------------------------------

    async def _table(self, request: Request) -> Response:
        """Return a control's table of a run, with what the command says of it."""
        found = self.found(request)
        words = ["correct", *found.inputs, f"--output={_TABLE}", *found.reading]
        options = words_of(request.query_params, _TABLE_OPTIONS, flags=("backlash", "drift_free"))
        folder = found.folder.path
        inputs = {file.name: file for file in (*found.inputs.values(), folder / "map.toml")}
        names = dict.fromkeys(found.inputs, found.name)
        names[_TABLE] = f"{request.query_params.get('control', '')}.txt"
        return await self._written(request, [*words, *options], _TABLE, inputs, names)

    async def _plan(self, request: Request) -> Response:
        """Return a plan of a run."""
        options = words_of(request.query_params, _PLAN_OPTIONS, flags=("rotary",))
        return await self._written(request, ["plan", f"--output={_PLAN}", *options], _PLAN, {}, {})

    async def _program(self, request: Request) -> Response:
        """Return the NC program of the plan that is the body."""
        words = ["program", _PLAN, f"--output={_PROGRAM}"]
        words += words_of(request.query_params, _PROGRAM_OPTIONS)
        inputs = {_PLAN: await request.body()}
        return await self._written(request, words, _PROGRAM, inputs, {_PLAN: "plan"})

    async def _written(
        self,
        request: Request,
        words: Sequence[str],
        file: str,
        inputs: Mapping[str, bytes | Path],
        names: Mapping[str, str],
    ) -> Response:
        """Return the file that a command writes, with what it prints."""
        there = {n: one for n, one in inputs.items() if isinstance(one, bytes) or one.exists()}
        async with self.work(request) as folder:
            await request.body()
            told = await self.ask(request, words, folder, names=names, inputs=there)
            content = (folder.path / file).read_bytes().decode("utf-8", "replace")
        return answer_json({"file": content, **told})

    # ---- forms ---------------------------------------------------------------------------------

    async def _toml(self, request: Request) -> Response:
        """Return what a TOML file states, for the forms."""
        return answer_json(texts_of(await request.body()))

    async def _form(self, request: Request) -> Response:
        """Keep what a form was filled with for the next time."""
        form, text = request.path_params["form"], await request.body()
        if form not in forms():
            raise no_option("form")
        if text:
            judge(form, text, spoken(request))
        self._forms.keep(self.owner(request).name, form, text)
        return answer_json({})


# ---- what is asked ------------------------------------------------------------------------------


def stored_name(given: str) -> str:
    """Return the name under which an uploaded file is stored: one of a few."""
    lower = given[-16:].lower()
    if lower.endswith("_iso230.dat"):
        return "run_ISO230.dat"
    return "run" + next((one for one in _EXTENSIONS if lower.endswith(one)), ".txt")


def _shown(entry: Entry, request: Request) -> Response:
    about = {"id": entry.id, "name": entry.name, "at": entry.at_utc.isoformat()}
    return answer_json({**spoken_as(entry.told, spoken(request)), **about})
