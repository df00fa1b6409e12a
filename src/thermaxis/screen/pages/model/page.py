"""The page of the model in force: what it is made of, where it may be believed, and another one."""

import contextlib
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple, cast, final

from markupsafe import Markup, escape
from starlette.requests import HTTPConnection, Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from thermaxis.codes import Message
from thermaxis.compensation import gain_of
from thermaxis.errors import ConfigurationError
from thermaxis.messages import END_OF_ISOLATE, ISOLATE, sentence, sentence_of, text_of
from thermaxis.runtime import Clock, MachineConfiguration, ModelFile, Role
from thermaxis.runtime.config import read_model_file
from thermaxis.screen.access import fragment, needs, parts_of, render, visitor_of
from thermaxis.screen.pages.history import Kept, WorkerThread
from thermaxis.screen.pages.model._choices import Choice, ModelChoices
from thermaxis.screen.pages.model._facts import charts_of, is_held, longest_record_s
from thermaxis.web import answer_json

if TYPE_CHECKING:
    from thermaxis.screen.access import ScreenParts

LIMIT_S: Final = 4.0
"""A folder that does not answer for so long is waited for no longer: it may lie in a network. [s]
"""
KEPT_S: Final = 2.0
"""A list of the folder serves all who ask within this time. [s]"""
HANGS: Final = Message("model-hangs")
"""Why the model in force cannot be shown while the folder hangs."""
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
    return render(request, "model.html", page="model")


@needs(Role.VIEWER)
async def _values(request: Request) -> Response:
    """Tell everything about the model in force, or in words why nothing can be told."""
    parts = parts_of(request)
    status = parts.feed.latest.status
    name, sha256 = str(status.get("model_file", "")), str(status.get("model_sha256", ""))
    diameter = status.get("diameter_mm")
    diameter_mm = float(diameter) if isinstance(diameter, int | float) else None
    models, language = _read_models(request), visitor_of(request).language
    choices = await models.choices()
    found = await models.of(name, sha256)
    model = found.file.model if found.file else None
    shown = {"file": name, "hash": f"{sha256[:_HASH_SHOWN]}…"}
    said = [sentence(found.key, shown, language=language)] if found.key else []
    if found.detail is not None:  # without the path: a viewer need not know it
        said.append(sentence_of(found.detail, language=language))
    told = {
        output: tuple(one.get("parts_um", ())) for output, one in status.get("outputs", {}).items()
    }
    return answer_json(
        {
            "sha256": sha256,
            "model": charts_of(model, diameter_mm) if model else None,
            "text": " ".join(said),
            "choices": fragment(
                request,
                "model_choices.html",
                file=name,
                fit=[one for one in choices if one.refused is None],
                others=[(one.name, _why(one, language)) for one in choices if not one.sha256],
                may_choose=visitor_of(request).role.at_least(Role.ENGINEER),
            )
            if choices
            else "",
            "html": fragment(
                request,
                "model_values.html",
                model=model,
                record_s=longest_record_s(model) if model else None,
                diameter_mm=diameter_mm,
                rules=parts.configuration.compensation,
                told=told,
                gain_of=gain_of,
                is_held=is_held,
            ),
        }
    )


def _why(choice: Choice, language: str) -> Markup:
    """Return why a file cannot be chosen, or was not read; what of it is English is marked so."""
    if choice.refused is None:
        return escape(sentence("model-choice_not_read", language=language))
    place = choice.refused.place._replace(file="")
    said = escape(text_of(replace(choice.refused, place=place), language=language))
    english, end = Markup('<span lang="en">'), Markup("</span>")
    return said.replace(ISOLATE, english).replace(END_OF_ISOLATE, end)


@final
class ReadModels:
    """The folder's models and the model in force, read in threads, once for all viewers.

    The hash is of the model itself: what it was read from may change or go; what cannot be shown
    is looked for again. While the folder does not answer, the last list of it stands, and the
    model in force is shown if it is known.
    """

    def __init__(
        self, configuration: MachineConfiguration, clock: Clock, *, limit_s: float = LIMIT_S
    ) -> None:
        self._configuration = configuration
        self._looking, self._reading = WorkerThread(limit_s), WorkerThread(limit_s)
        self._choices = ModelChoices(configuration)
        self._last: tuple[Choice, ...] = ()
        self._kept = Kept(self._look, clock, KEPT_S)
        self._known: tuple[tuple[str, str], Found] | None = None

    async def choices(self) -> tuple[Choice, ...]:
        """Return the files of the folder, those that cannot be chosen with the reason."""
        return await self._kept.get()

    async def of(self, name: str, sha256: str) -> Found:
        """Return the model that the loop tells to be in force."""
        try:
            return self._of(name, sha256) or await self._reading.run(
                lambda: self._read(name, sha256)
            )
        except TimeoutError:
            return Found(None, NO_FILE, HANGS)

    async def _look(self) -> tuple[Choice, ...]:
        with contextlib.suppress(OSError):  # such as no answer in time: the list of before stands
            self._last = await self._looking.run(self._choices.look)
        return self._last

    def _of(self, name: str, sha256: str) -> Found | None:
        known = self._known
        return known[1] if known and known[0] == (name, sha256) else None

    def _read(self, name: str, sha256: str) -> Found:
        found = self._of(name, sha256)  # who waited finds what the one before has read
        if found is None:
            found = model_in_force(self._configuration, name, sha256)
            if found.file is not None:
                self._known = (name, sha256), found
        return found


def _read_models(connection: HTTPConnection) -> ReadModels:
    """Return what was read, for all viewers; made at the first question."""
    state = connection.app.state
    if not hasattr(state, "read_models"):
        parts = parts_of(connection)
        state.read_models = ReadModels(parts.configuration, parts.clock)
    return cast("ReadModels", state.read_models)
