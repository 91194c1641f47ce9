"""The check for the extra `bags`: the libraries that reading and writing bags needs."""

from __future__ import annotations

from importlib.util import find_spec
from typing import Final

from actors.bags.errors import MissingExtraError

_MODULES: Final = ("mcap", "zstandard", "lz4")


def require_extra() -> None:
    """Check that the extra `bags` is installed.

    Raises:
        MissingExtraError: It is not installed; the text says how to install it.
    """
    if any(find_spec(each) is None for each in _MODULES):
        raise MissingExtraError
