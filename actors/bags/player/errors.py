"""Errors of playing.

BagError (actors.bags.errors)
└── InvalidPlayingError    what is to be played, or an option of it, is wrong
"""

from __future__ import annotations

from actors.bags.errors import BagError


class InvalidPlayingError(BagError, ValueError):
    """What is to be played, or an option of it, is wrong; the text says what, and what is allowed."""
