"""Serves the files of `assets/`, which a process reads and compresses once."""

from __future__ import annotations

import gzip
import hashlib
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import TYPE_CHECKING, Final

from aiohttp import web

if TYPE_CHECKING:
    from collections.abc import Iterator
    from importlib.resources.abc import Traversable

INDEX: Final = "index.html"
CONTENT_TYPES: Final = {
    ".css": "text/css; charset=utf-8",
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".md": "text/plain; charset=utf-8",
    ".mjs": "text/javascript; charset=utf-8",
    ".svg": "image/svg+xml",
    ".txt": "text/plain; charset=utf-8",
}
"""Content types by suffix. Not the system's table, which differs between machines."""


@dataclass(frozen=True, kw_only=True, slots=True)
class PageFile:
    """One file of the page.

    Attributes:
        content: Its bytes.
        compressed: The same with gzip.
        content_type: Of the answer.
        etag: Changes with the content.
    """

    content: bytes
    compressed: bytes
    content_type: str
    etag: str


class PageFiles:
    """All files of the page, by their path below the page's address."""

    def __init__(self) -> None:
        self._files = _all_files()

    async def serve(self, request: web.Request) -> web.Response:
        """Answer a request for a file; the browser asks each time whether it has changed.

        Raises:
            web.HTTPNotFound: There is no such file.
        """
        asset = self._files.get(request.match_info.get("path") or INDEX)
        if asset is None:
            raise web.HTTPNotFound(text="There is no such page")
        headers = {"Cache-Control": "no-cache", "ETag": f'"{asset.etag}"', "Vary": "Accept-Encoding"}
        if any(each.value == asset.etag for each in request.if_none_match or ()):
            return web.Response(status=304, headers=headers)
        body = asset.content
        if "gzip" in request.headers.get("Accept-Encoding", ""):
            body, headers["Content-Encoding"] = asset.compressed, "gzip"
        headers["Content-Type"] = asset.content_type
        return web.Response(body=body, headers=headers)


@cache
def _all_files() -> dict[str, PageFile]:
    return {path: _read(path, file) for path, file in _walk(files("actors.web") / "assets")}


def _walk(folder: Traversable, prefix: str = "") -> Iterator[tuple[str, Traversable]]:
    for each in folder.iterdir():
        if each.is_dir():
            yield from _walk(each, f"{prefix}{each.name}/")
        else:
            yield f"{prefix}{each.name}", each


def _read(path: str, file: Traversable) -> PageFile:
    content = file.read_bytes()
    suffix = path[path.rfind(".") :]
    return PageFile(
        content=content,
        compressed=gzip.compress(content, mtime=0),
        content_type=CONTENT_TYPES.get(suffix, "application/octet-stream"),
        etag=hashlib.sha256(content).hexdigest()[:16],
    )
