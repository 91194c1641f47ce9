"""The file of access rules: reads it, and replaces it under a lock. Makes tokens."""

from __future__ import annotations

import os
import secrets
import stat
from typing import TYPE_CHECKING

from broker.access.credentials import TOKEN_BYTES, TOKEN_PREFIX
from broker.access.errors import AccessFileError
from broker.access.parse import MAX_FILE_BYTES, parse_rules
from broker.access.private_file import write_private
from proto.aio.file_lock import hold_lock

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from broker.access.rules import AccessRules


def load_rules(path: Path) -> AccessRules:
    """Return the rules in a file.

    Raises:
        AccessFileError: It cannot be read, every user of the machine may write to it, or it is broken.
    """
    return parse_rules(read_text(path), str(path))


def read_text(path: Path) -> str:
    """Return the content of a file of rules.

    Raises:
        AccessFileError: It cannot be read, or every user of the machine may write to it.
    """
    try:
        with path.open("rb") as file:
            mode = os.fstat(file.fileno()).st_mode  # of the open file: the path may be replaced meanwhile
            content = file.read(MAX_FILE_BYTES + 1)
    except FileNotFoundError as error:
        hint = "`callboard auth add` writes the file"
        raise AccessFileError(f"There are no access rules in {path}: {hint}") from error
    except OSError as error:
        raise AccessFileError(f"Cannot read {path}: {error.strerror or error}") from error
    if stat.S_ISREG(mode) and mode & stat.S_IWOTH:
        raise AccessFileError(f"{path}: everybody may write to it; change that with `chmod o-w {path}`")
    if len(content) > MAX_FILE_BYTES:
        raise AccessFileError(f"{path} is longer than {MAX_FILE_BYTES} bytes")
    try:
        return content.decode()
    except UnicodeDecodeError as error:
        raise AccessFileError(f"{path}: not UTF-8: {error.reason}") from error


def edit_rules(path: Path, change: Callable[[str], str], *, new: str | None = None) -> None:
    """Change the text of a file of rules under a lock, so that simultaneous edits keep each other.

    Args:
        path: The file. It keeps its permissions; a new one is for its owner only.
        change: Returns the new text for the old one.
        new: The text for `change` if there is no file; None to raise an error then.

    Raises:
        AccessFileError: The file cannot be read or locked, another process holds the lock for 5 s, or
            `change` raises it.
        CallboardError: It cannot be written.
    """
    if new is None:
        read_text(path)  # before a folder or a lock file is made
    try:
        with hold_lock(str(path.resolve())):  # the same for each symbolic link to the file
            text = new if new is not None and not path.exists() else read_text(path)
            write_private(path, change(text), keep_mode=True)
    except OSError as error:
        raise AccessFileError(f"Cannot write {path}: {error.strerror or error}") from error


def new_token() -> str:
    """Return a new random token."""
    return TOKEN_PREFIX + secrets.token_urlsafe(TOKEN_BYTES)
