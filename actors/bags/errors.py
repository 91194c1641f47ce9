"""Errors of bags.

CallboardError (proto.errors)
└── BagError                  something about a bag cannot be done
    ├── InvalidBagError (ValueError)  a file of a bag is damaged, or no bag at all: names file and place
    ├── BagNotFoundError (LookupError)  there is no bag at this path
    ├── BagExistsError        there is something at the path of a new bag
    ├── BagWriteError         a file of a bag cannot be written any more
    │   └── BagFullError      because its disk is full
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
"""The numbers of OSError that mean: no space for more."""


class BagError(CallboardError):
    """Something about a bag cannot be done; the text says what, and the remedy."""


class InvalidBagError(BagError, ValueError):
    """A file of a bag is damaged, or no bag at all.

    Attributes:
        path: The file.
        place: Where, such as "byte 1,024" or "line 3"; "" for the whole file.
        reason: What is wrong, and the remedy.
    """

    def __init__(self, path: str | Path, place: str, reason: str) -> None:
        # With these arguments, and not one string, so that the error can be copied and pickled.
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
    """A file of a bag cannot be written any more; what it has is kept, and can be read."""

    is_operational = True


class BagFullError(BagWriteError):
    """The disk of a bag is full; what has been written is kept, and can be read."""


class MissingExtraError(BagError):
    """A package of the extra `bags` is not installed."""

    def __init__(self) -> None:
        super().__init__(f"Bags need more packages: {install_command('bags')}")


def write_error(path: str | Path, error: OSError) -> BagWriteError:
    """Return the error for a file that cannot be written.

    Args:
        path: The file.
        error: What the operating system says.
    """
    if error.errno in FULL:
        return BagFullError(
            f"{path}: the disk is full ({error.strerror}); free some space, then record again"
        )
    return BagWriteError(f"{path}: cannot be written: {error.strerror or error}")
