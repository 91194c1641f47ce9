"""The extra `bags`: what reading and writing MCAP needs, and nothing else of callboard imports."""

from __future__ import annotations

from importlib.util import find_spec
from typing import Final

from actors.bags.errors import MissingExtraError

_MODULES: Final = ("mcap", "zstandard", "lz4")


def require_extra() -> None:
    """Check that the extra `bags` is installed.

    Raises:
        MissingExtraError: It is not; the text says how to install it.
    """
    if any(find_spec(each) is None for each in _MODULES):
        raise MissingExtraError
