"""What the pages share: configuration, feed and people."""

import json
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, cast, final

from starlette.requests import HTTPConnection

from thermaxis.runtime import Clock, MachineConfiguration, ScreenSettings
from thermaxis.screen.access._user_sessions import UserSessions
from thermaxis.screen.feed import StatusFeed

NAVIGATION: Final = ("operator", "model", "sensors", "history", "probe", "positioning")
"""Pages in the order of their buttons."""


@dataclass(frozen=True, slots=True, kw_only=True)
class AccessParts(ABC):
    """What log-in and frame of pages are made from, of a machine or of a fleet."""

    settings: ScreenSettings
    """How they are served: table ``[screen]``."""
    persons: UserSessions
    secure: bool = False
    """Whether the pages go through TLS."""

    @property
    def language(self) -> str:
        """Language of who has chosen none."""
        return self.settings.language

    def shown_names(self, language: str) -> dict[str, str]:
        """Return what people call what is told."""
        del language
        return {}

    @abstractmethod
    def frame(self, names: Mapping[str, str]) -> Mapping[str, object]:
        """Return what the template ``base`` takes."""


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class ScreenParts(AccessParts):
    """What every page is made from."""

    configuration: MachineConfiguration
    clock: Clock
    feed: StatusFeed
    program: str
    """Name of this run of the screen; another one makes open pages load themselves again."""
    configuration_sha256: str = ""
    """Hash of the configuration's rules; a loop that tells another one works by others. Empty:
    pages do not compare it."""

    def shown_names(self, language: str) -> dict[str, str]:
        """Return what people call what is told, of the model in force."""
        model_sha256 = self.feed.latest.status.get("model_sha256") or ""
        return self.configuration.shown_names(language, model_sha256)

    def frame(self, names: Mapping[str, str]) -> Mapping[str, object]:
        """Return what the frame of every page takes."""
        server = self.configuration.server
        return {
            "base": "base.html",
            "pages": NAVIGATION,
            "people": server is not None and server.users is not None,
            "machine": self.configuration.name,
            "configuration_sha256": self.configuration_sha256,
            "program": self.program,
            "names": json.dumps(dict(names), ensure_ascii=False),
        }


def parts_of(connection: HTTPConnection) -> ScreenParts:
    """Return what the pages share."""
    return cast("ScreenParts", connection.app.state.parts)


def access_of(connection: HTTPConnection) -> AccessParts:
    """Return what log-in and frame are made from."""
    return cast("AccessParts", connection.app.state.parts)
