"""Files that clients fetch, such as meshes: those in the share folders of installed packages."""

from __future__ import annotations

from pathlib import Path, PurePosixPath
from typing import Final
from urllib.parse import unquote, urlsplit

from actors.regular_files import read_regular
from actors.tools.prefixes import package_prefix
from proto.errors import CallboardError
from proto.untrusted_text import escape

MAX_ASSET_BYTES: Final = 32 * 1024 * 1024
"""The largest file that is sent; meshes have a few MiB."""

SCHEME: Final = "package"


class AssetError(CallboardError):
    """The file is not served; the text says why."""


def read_asset(uri: str) -> bytes:
    """Return the content of a file. It blocks.

    Args:
        uri: As "package://turtle_description/meshes/shell.stl".

    Raises:
        AssetError: It is no file in the share folder of an installed package, or too large.
    """
    shown = escape(uri)
    try:
        parts = urlsplit(uri)
        relative = PurePosixPath(unquote(parts.path, errors="strict").lstrip("/"))
    except ValueError:
        raise AssetError(f"'{shown}' is no address of a file") from None
    if parts.scheme != SCHEME:
        raise AssetError(f"'{shown}': only files of packages are served, as package://PACKAGE/FILE")
    prefix = package_prefix(parts.netloc)
    if prefix is None:
        raise AssetError(f"'{shown}': no such package is installed where the server runs")
    try:
        folder = (prefix / "share" / parts.netloc).resolve()
        file = Path(folder, relative).resolve()
        # A symbolic link may lead out of the folder as `..` does.
        if ".." in relative.parts or not file.is_relative_to(folder):
            raise AssetError(f"'{shown}' is not in the share folder of its package")
        content = read_regular(file, MAX_ASSET_BYTES + 1)
    except (OSError, ValueError, RuntimeError):  # NUL in a name; links in a circle
        raise AssetError(f"'{shown}': the package has no such file") from None
    if len(content) > MAX_ASSET_BYTES:
        raise AssetError(f"'{shown}' has more than {MAX_ASSET_BYTES >> 20} MiB")
    return content
