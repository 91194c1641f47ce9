"""Writes files that only their owner may read: access rules, tokens, the broker's URL."""

from __future__ import annotations

import os
import stat
import sys
import tempfile
from contextlib import suppress
from pathlib import Path

from proto.errors import CallboardError


def write_private(path: Path, text: str, *, keep_mode: bool = False) -> None:
    """Replace a file atomically by one that only its owner may read; make its folder if necessary.

    Args:
        path: The file.
        text: Its new content, written in UTF-8.
        keep_mode: Whether an existing file keeps its permissions, and its owner and group if this user may
            set them.

    Raises:
        CallboardError: It cannot be written.
    """
    written: Path | None = None
    try:
        path = path.resolve()  # replace what a symbolic link points to, not the link
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        mode = stat.S_IMODE(path.stat().st_mode) if keep_mode and path.exists() else 0o600
        with tempfile.NamedTemporaryFile(
            "w", encoding="utf-8", dir=path.parent, prefix=f".{path.name}.", delete=False
        ) as file:
            written = Path(file.name)
            file.write(text)
        written.chmod(mode)
        if keep_mode and path.exists():
            _keep_owner(path, written)
        written.replace(path)
    except OSError as error:
        if written is not None:
            written.unlink(missing_ok=True)
        raise CallboardError(f"Cannot write {path}: {error.strerror or error}") from error


def _keep_owner(path: Path, written: Path) -> None:
    """Give a new file the owner and the group of the one that it replaces."""
    if sys.platform == "win32":
        return
    before = path.stat()
    with suppress(PermissionError):  # only root may set both
        os.chown(written, before.st_uid, before.st_gid)
