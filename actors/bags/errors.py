"""Errors of bags.

CallboardError (proto.errors)
└── BagError                  a bag cannot be read, written, recorded or played
    ├── InvalidBagError (ValueError)  a file of a bag is damaged, or not a bag; names file and place
    ├── BagNotFoundError (LookupError)  there is no bag at this path
    ├── BagExistsError        there is something at the path of a new bag
    ├── BagWriteError         a file of a bag cannot be written any more
    │   └── BagFullError      because its disk is full
    ├── InvalidBagOptionError (ValueError)  an option of a recorder, player or writer is wrong
    └── MissingExtraError     a package of the extra `bags` is not installed
"""

from __future__ import annotations

import errno
from typing import TYPE_CHECKING, Final

from proto.errors import CallboardError
from proto.extras import install_command

if TYPE_CHECKING:
    from pathlib import Path

FULL: Final = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EFBIG})
"""Error numbers that mean that there is no space left."""


class BagError(CallboardError):
    """A bag cannot be read, written, recorded or played; the text says why, and how to remedy it."""


class InvalidBagError(BagError, ValueError):
    """A file of a bag is damaged, or not a bag.

    Attributes:
        path: The file.
        place: Where in the file, such as "byte 1,024" or "line 3"; "" for the whole file.
        reason: What is wrong, and how to remedy it.
    """

    def __init__(self, path: str | Path, place: str, reason: str) -> None:
        # Pass the arguments of this method: copying and pickling call it with them again.
        super().__init__(path, place, reason)
        self.path = path
        self.place = place
        self.reason = reason

    def __str__(self) -> str:
        return f"{self.path}: {f'{self.place}: ' if self.place else ''}{self.reason}"


class BagNotFoundError(BagError, LookupError):
    """There is no bag at this path."""


class BagExistsError(BagError):
    """There is something at the path of a new bag."""


class BagWriteError(BagError):
    """A file of a bag cannot be written any more. What has been written can be read."""

    is_operational = True


class BagFullError(BagWriteError):
    """The disk is full. What has been written can be read."""


class InvalidBagOptionError(BagError, ValueError):
    """An option of a recorder, player or writer is wrong; the text says what is allowed.

    Attributes:
        options: The names of options in the text, so that a command line can show its own instead.
    """

    def __init__(self, text: str, *options: str) -> None:
        super().__init__(text, *options)
        self.options = options

    def __str__(self) -> str:
        return str(self.args[0])


class MissingExtraError(BagError):
    """A package of the extra `bags` is not installed."""

    def __init__(self) -> None:
        super().__init__(f"Bags need more packages: {install_command('bags')}")


def write_error(path: str | Path, error: OSError) -> BagWriteError:
    """Return the error for a file that cannot be written.

    Args:
        path: The file.
        error: The error of the operating system.
    """
    if error.errno in FULL:
        return BagFullError(
            f"{path}: the disk is full ({error.strerror}); free some space, then record again"
        )
    return BagWriteError(f"{path}: cannot be written: {error.strerror or error}")
