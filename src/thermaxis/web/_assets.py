"""Scripts and styles: a fixed list of files from this package."""

import gzip
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import final

from starlette.requests import Request
from starlette.responses import Response

from thermaxis.web._scripts import asset_folder, static_version

_KINDS = {".js": "text/javascript", ".css": "text/css", ".svg": "image/svg+xml"}
_NOT_FOUND, _NOT_MODIFIED = 404, 304
_FOR_EVER = "max-age=31536000, immutable"


@final
class Assets:
    """Every file by its name: what is not in the list does not exist."""

    def __init__(self) -> None:
        folder = asset_folder()
        files = (path for path in folder.rglob("*") if path.suffix in _KINDS)
        self._paths = {path.relative_to(folder).as_posix(): path for path in files}
        self._packed = cache(_packed)  # files do not change while the program runs

    def read(self) -> None:
        """Read and pack every file: for a thread, before the first request."""
        for path in self._paths.values():
            self._packed(path)

    async def answer(self, request: Request) -> Response:
        """Return a file, packed for browsers that take gzip; or that the browser has it already.

        At an address that names the version the browser keeps it and asks no more. The request's
        path parameter ``name`` is the file's name.
        """
        asked = str(request.path_params["name"])
        name = asked.removeprefix(f"{static_version()}/")
        path = self._paths.get(name)
        if path is None:
            return Response(status_code=_NOT_FOUND)
        tag, plain, packed = self._packed(path)
        kept = "no-cache" if name == asked else _FOR_EVER
        headers = {"ETag": tag, "Cache-Control": kept, "Vary": "Accept-Encoding"}
        if request.headers.get("if-none-match") == tag:
            return Response(status_code=_NOT_MODIFIED, headers=headers)
        kind = _KINDS[path.suffix]
        if "gzip" not in request.headers.get("accept-encoding", ""):
            return Response(plain, headers=headers, media_type=kind)
        return Response(packed, headers={**headers, "Content-Encoding": "gzip"}, media_type=kind)


def _packed(path: Path) -> tuple[str, bytes, bytes]:
    """Return what tells a file from another version, its content, and the same packed."""
    content = path.read_bytes()
    return f'"{sha256(content).hexdigest()[:32]}"', content, gzip.compress(content, 6, mtime=0)
