"""Scripts and styles: a fixed list of files from this package, and the chart library's script."""

import gzip
from hashlib import sha256
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple, final

from starlette.requests import Request
from starlette.responses import Response

from thermaxis.codes import Place
from thermaxis.errors import ConfigurationError
from thermaxis.screen.access import asset_folder

CHART_SCRIPT = "plotly.min.js"
"""The script that draws charts; it comes with the Python package plotly."""
_KINDS = {
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".svg": "image/svg+xml",
}
_NOT_FOUND, _NOT_MODIFIED = 404, 304


class _Packed(NamedTuple):
    """A file."""

    tag: str
    """What tells it from another version."""
    plain: bytes
    """Its content."""
    packed: bytes
    """The same for browsers that take gzip: all."""


@final
class Assets:
    """Every file by its name: what is not in the list does not exist.

    Raises
    ------
    ConfigurationError
        If the chart library is not installed.
    """

    def __init__(self) -> None:
        folder = asset_folder()
        files = (path for path in folder.rglob("*") if path.suffix in _KINDS)
        own = {path.relative_to(folder).as_posix(): path for path in files}
        self._paths = {**own, CHART_SCRIPT: chart_script()}
        self._read: dict[str, _Packed] = {}

    def read(self) -> None:
        """Read and pack every file: the chart library's takes some tenths of a second.

        It is for a thread, before the first request; what is asked for sooner is packed then.
        """
        for name, path in self._paths.items():
            self._packed(name, path)

    def answer(self, request: Request) -> Response:
        """Return a file, packed; or that the browser has it already.

        Parameters
        ----------
        request : Request
            Its path parameter ``name`` is the file's name.

        Returns
        -------
        Response
            The file, 304 or 404.
        """
        name = str(request.path_params["name"])
        path = self._paths.get(name)
        if path is None:
            return Response(status_code=_NOT_FOUND)
        tag, plain, packed = self._packed(name, path)
        headers = {"ETag": tag, "Cache-Control": "no-cache", "Vary": "Accept-Encoding"}
        if request.headers.get("if-none-match") == tag:
            return Response(status_code=_NOT_MODIFIED, headers=headers)
        kind = _KINDS[path.suffix]
        if "gzip" not in request.headers.get("accept-encoding", ""):
            return Response(plain, headers=headers, media_type=kind)
        headers["Content-Encoding"] = "gzip"
        return Response(packed, headers=headers, media_type=kind)

    def _packed(self, name: str, path: Path) -> _Packed:
        """Pack a file once; it does not change while the program runs."""
        found = self._read.get(name)
        if found is None:
            content = path.read_bytes()
            tag = f'"{sha256(content).hexdigest()[:32]}"'
            found = _Packed(tag, content, gzip.compress(content, 6, mtime=0))
            self._read[name] = found
        return found


def chart_script() -> Path:
    """Return the script of the chart library."""
    spec = find_spec("plotly")
    for folder in (spec.submodule_search_locations or ()) if spec is not None else ():
        path = Path(folder) / "package_data" / CHART_SCRIPT
        if path.is_file():
            return path
    raise ConfigurationError("chart_script_missing", place=Place(file="plotly"))
