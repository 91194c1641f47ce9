"""Reads files that were found, not named: in folders of packages and of settings, where anything may lie.

A named pipe there would be waited for without end, and a device never ends. What a user names himself may be
either (`--params-file <(...)`), and is not read by this.
"""

from __future__ import annotations

import errno
import os
import stat
from io import BytesIO, TextIOWrapper
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from pathlib import Path

_WITHOUT_WAITING: Final = getattr(os, "O_NONBLOCK", 0)


def read_regular(path: str | Path, most: int = -1) -> bytes:
    """Return the content of a file, or its first bytes.

    Args:
        path: The file; it may be a symbolic link to one.
        most: How many bytes; -1: all of it.

    Raises:
        OSError: It cannot be read, or is no regular file.
    """

    def opener(name: str, flags: int) -> int:
        return os.open(name, flags | _WITHOUT_WAITING)

    with open(path, "rb", opener=opener) as file:
        if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
            raise OSError(errno.EINVAL, "not a regular file", str(path))
        return file.read(most)


def read_regular_text(path: Path, encoding: str = "utf-8") -> str:
    """Return the text of a file, as `Path.read_text` does.

    Raises:
        OSError: As for `read_regular`.
        UnicodeDecodeError: It has another encoding.
    """
    return TextIOWrapper(BytesIO(read_regular(path)), encoding=encoding).read()


def is_within(path: Path, folder: Path) -> bool:
    """Return whether what is written to a path stays in a folder, and becomes a regular file.

    Args:
        path: A path in the folder; it need not exist, and a symbolic link on the way may lead elsewhere.
        folder: The folder.
    """
    return path.resolve().is_relative_to(folder.resolve()) and (path.is_file() or not path.exists())
