"""What the pages share: configuration, feed and people."""

from dataclasses import dataclass
from typing import cast, final

from starlette.requests import HTTPConnection

from thermaxis.runtime import Clock, MachineConfiguration, ScreenSettings
from thermaxis.screen.access._user_sessions import UserSessions
from thermaxis.screen.feed import StatusFeed


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class ScreenParts:
    """What every page is made from."""

    configuration: MachineConfiguration
    """The machine's configuration."""
    settings: ScreenSettings
    """Its table ``[screen]``."""
    clock: Clock
    """Time."""
    feed: StatusFeed
    """What the loop tells."""
    persons: UserSessions
    """Who has logged in."""
    program: str
    """Name of this run of the screen; another one makes open pages load themselves again."""
    secure: bool = False
    """Whether the pages go through TLS."""
    configuration_sha256: str = ""
    """Hash of the configuration's rules; a loop that tells another one works by others. Empty:
    pages do not compare it."""

    @property
    def language(self) -> str:
        """Language of who has chosen none."""
        return self.settings.language

    def shown_names(self, language: str) -> dict[str, str]:
        """Return what people call what is told, of the model in force."""
        model_sha256 = self.feed.latest.status.get("model_sha256") or ""
        return self.configuration.shown_names(language, model_sha256)


def parts_of(connection: HTTPConnection) -> ScreenParts:
    """Return what the pages share."""
    return cast("ScreenParts", connection.app.state.parts)
