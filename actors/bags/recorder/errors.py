"""Errors of recording.

BagError (actors.bags.errors)
└── InvalidRecordingError    what is to be recorded, or an option of it, is wrong
"""

from __future__ import annotations

from actors.bags.errors import BagError


class InvalidRecordingError(BagError, ValueError):
    """What is to be recorded, or an option of it, is wrong; the text says what, and what is allowed."""
