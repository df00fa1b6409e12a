"""The page of the model in force: what it is made of, where it may be believed, and another one."""

import asyncio
import contextlib
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple, cast, final

from starlette.requests import HTTPConnection, Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from thermaxis.codes import Message
from thermaxis.errors import ConfigurationError
from thermaxis.messages import sentence, sentence_of, text_of
from thermaxis.runtime import Clock, MachineConfiguration, ModelFile, Role
from thermaxis.runtime.config import read_model_file
from thermaxis.screen.access import fragment, needs, parts_of, render, visitor_of
from thermaxis.screen.pages.history import Aside, Json, Kept
from thermaxis.screen.pages.model._choices import Choice, ModelChoices
from thermaxis.screen.pages.model._facts import facts_of_model
from thermaxis.web import answer_json

if TYPE_CHECKING:
    from thermaxis.screen.access import ScreenParts

LIMIT_S: Final = 4.0
"""A folder that does not answer for so long is waited for no longer: it may lie in a network. [s]
"""
KEPT_S: Final = 2.0
"""A list of the folder serves all who ask within this time. [s]"""
MOST_READING: Final = 2
"""Threads that read models; one that hangs keeps its place. [1]"""
HANGS: Final = Message("model-hangs")
"""Why the model in force cannot be shown while the folder hangs."""
MOST_KNOWN: Final = 8
"""Models whose facts are kept. [1]"""
NO_STATUS = "model-no_status"
"""The loop has not told yet which model is in force."""
OTHER_FILE = "model-other_file"
"""The file on disk is another one than the model in force."""
NO_FILE = "model-no_file"
"""There is no such file on the computer of the screen, or it cannot be read."""
_HASH_SHOWN = 16


class Found(NamedTuple):
    """The model in force, or why it cannot be shown."""

    file: ModelFile | None
    """The model with its file."""
    key: str = ""
    """Key of the words that say why there is none."""
    detail: Message | None = None
    """The failure, where there is one."""


def routes(parts: "ScreenParts") -> list[BaseRoute]:
    """Return the routes of the page."""
    del parts
    return [
        Route("/model", _page, methods=["GET"]),
        Route("/model/values", _values, methods=["GET"]),
        Route("/model/choice", _choice, methods=["GET"]),
    ]


def model_in_force(configuration: MachineConfiguration, name: str, sha256: str) -> Found:
    """Read the file of the model in force, and show nothing of any other.

    Not protected: the hash is that which the loop tells. A loop that was replaced by another
    program may tell anything.
    """
    if not name or not sha256:
        return Found(None, NO_STATUS)
    read = False
    detail = None
    for path in _places_of(configuration, name):
        try:
            found = read_model_file(path)
        except ConfigurationError as error:
            detail = detail or error.message
            continue
        if found.sha256 == sha256:
            return Found(found)
        read = True
    return Found(None, OTHER_FILE) if read else Found(None, NO_FILE, detail)


def _places_of(configuration: MachineConfiguration, name: str) -> list[Path]:
    """Return where a model of that name may lie: only the configured file and folder."""
    places: list[Path] = []
    if configuration.model.path.name == name:
        places.append(configuration.model.path)
    try:
        chosen = configuration.find_model(name)
    except ConfigurationError:
        return places
    return places if chosen in places else [*places, chosen]


@needs(Role.VIEWER, page=True)
async def _page(request: Request) -> Response:
    return render(
        request,
        "model.html",
        page="model",
        may_choose=visitor_of(request).role.at_least(Role.ENGINEER),
    )


@needs(Role.VIEWER)
async def _values(request: Request) -> Response:
    """Tell everything about the model in force, or in words why nothing can be told."""
    parts = parts_of(request)
    status = parts.feed.latest.status
    name, sha256 = str(status.get("model_file", "")), str(status.get("model_sha256", ""))
    diameter = status.get("diameter_mm")
    diameter_mm = float(diameter) if isinstance(diameter, int | float) else None
    found, facts, choices = await _read_models(request).of(name, sha256, diameter_mm)
    language = visitor_of(request).language
    shown = {"file": name, "hash": f"{sha256[:_HASH_SHOWN]}…"}
    said = [sentence(found.key, shown, language=language)] if found.key else []
    if found.detail is not None:  # without the path: a viewer need not know it
        said.append(sentence_of(found.detail, language=language))
    told = {
        output: tuple(one.get("parts_um", ())) for output, one in status.get("outputs", {}).items()
    }
    return answer_json(
        {
            "file": name,
            "sha256": sha256,
            "model": facts,
            "text": " ".join(said),
            "choices": [_told(choice, language) for choice in choices],
            "html": fragment(request, "model_values.html", model=facts, told=told),
        }
    )


def _told(choice: Choice, language: str) -> Json:
    """Return a file of the folder with why it cannot be chosen, in the language of who asks."""
    reason = "" if choice.judged else sentence("model-choice_not_read", language=language)
    if choice.refused is not None:
        place = choice.refused.place._replace(file="")
        reason = text_of(replace(choice.refused, place=place), language=language)
    return {"name": choice.name, "model": choice.refused is None, "reason": reason}


@needs(Role.VIEWER)
async def _choice(request: Request) -> Response:
    """Tell the hash of a model that may be chosen, by which a page sees that it is in force."""
    name = request.query_params.get("name", "")
    try:
        sha256 = await _read_models(request).hash_of(name)
    except (ConfigurationError, TimeoutError):  # the loop says what is wrong, when it is asked
        return answer_json({"sha256": None})
    return answer_json({"sha256": sha256})


class Read(NamedTuple):
    """What the page is made of."""

    found: Found
    """The model in force, or why there is none."""
    facts: Json | None
    """What is shown of it."""
    choices: tuple[Choice, ...]
    """Files of the folder, those that cannot be chosen with the reason."""


@final
class ReadModels:
    """Models in force that were read, by hash and diameter, so that viewers cost nothing more.

    The hash is of the model itself: what it was read from may change or go. One is read at a
    time, in a thread; what cannot be shown is looked for again. While the folder does not answer,
    the last list of it stands, and what is known of the model in force is shown.
    """

    def __init__(
        self, configuration: MachineConfiguration, clock: Clock, *, limit_s: float = LIMIT_S
    ) -> None:
        self._configuration = configuration
        self._limit_s = limit_s
        self._looking = Aside(limit_s, 1)  # a look remembers: there is never a second one beside it
        self._reading = Aside(limit_s, MOST_READING)
        self._choices = ModelChoices(configuration)
        self._last: tuple[Choice, ...] = ()
        self._kept = Kept(self._look, clock, KEPT_S)
        self._known: dict[tuple[str, str, float | None], tuple[Found, Json]] = {}
        self._turn = asyncio.Lock()

    async def of(self, name: str, sha256: str, diameter_mm: float | None) -> Read:
        """Return the model that the loop tells to be in force."""
        key = (name, sha256, diameter_mm)
        choices = await self._kept.get()
        known = self._known.get(key)
        if known is not None:
            return Read(*known, choices)
        try:
            async with asyncio.timeout(self._limit_s), self._turn:
                known = self._known.get(key)  # who waited finds what the one before has read
                if known is not None:
                    return Read(*known, choices)
                found, facts = await self._reading.run(lambda: self._read(*key))
        except TimeoutError:
            return Read(Found(None, NO_FILE, HANGS), None, choices)
        if facts is not None:
            self._known[key] = found, facts
            for oldest in list(self._known)[:-MOST_KNOWN]:
                del self._known[oldest]
        return Read(found, facts, choices)

    async def hash_of(self, name: str) -> str:
        """Return the hash of a model of the folder."""
        find = self._configuration.find_model
        return await self._reading.run(lambda: read_model_file(find(name)).sha256)

    async def _look(self) -> tuple[Choice, ...]:
        with contextlib.suppress(OSError):  # such as no answer in time: the list of before stands
            self._last = await self._looking.run(self._choices.look)
        return self._last

    def _read(self, name: str, sha256: str, diameter_mm: float | None) -> tuple[Found, Json | None]:
        configuration = self._configuration
        found = model_in_force(configuration, name, sha256)
        if found.file is None:
            return found, None
        return found, facts_of_model(configuration.compensation, found.file.model, diameter_mm)


def _read_models(connection: HTTPConnection) -> ReadModels:
    """Return what was read, for all viewers; made at the first question."""
    state = connection.app.state
    if not hasattr(state, "read_models"):
        parts = parts_of(connection)
        state.read_models = ReadModels(parts.configuration, parts.clock)
    return cast("ReadModels", state.read_models)
