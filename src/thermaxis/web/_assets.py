"""Scripts and styles: a fixed list of files from this package."""

import gzip
from hashlib import sha256
from pathlib import Path
from typing import NamedTuple, final

from starlette.requests import Request
from starlette.responses import Response

from thermaxis.web._scripts import asset_folder, static_version

_KINDS = {
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".svg": "image/svg+xml",
}
_NOT_FOUND, _NOT_MODIFIED = 404, 304
_FOR_EVER = "max-age=31536000, immutable"


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
    """Every file by its name: what is not in the list does not exist."""

    def __init__(self) -> None:
        folder = asset_folder()
        files = (path for path in folder.rglob("*") if path.suffix in _KINDS)
        self._paths = {path.relative_to(folder).as_posix(): path for path in files}
        self._read: dict[str, _Packed] = {}

    def read(self) -> None:
        """Read and pack every file: for a thread, before the first request."""
        for name, path in self._paths.items():
            self._packed(name, path)

    def answer(self, request: Request) -> Response:
        """Return a file, packed; or that the browser has it already.

        At an address that names the version the browser keeps it and asks no more.

        Parameters
        ----------
        request : Request
            Its path parameter ``name`` is the file's name.

        Returns
        -------
        Response
            The file, 304 or 404.
        """
        asked = str(request.path_params["name"])
        name = asked.removeprefix(f"{static_version()}/")
        path = self._paths.get(name)
        if path is None:
            return Response(status_code=_NOT_FOUND)
        tag, plain, packed = self._packed(name, path)
        kept = "no-cache" if name == asked else _FOR_EVER
        headers = {"ETag": tag, "Cache-Control": kept, "Vary": "Accept-Encoding"}
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
