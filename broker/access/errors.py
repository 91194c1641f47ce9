"""The error of access rules: below `CallboardError`, beside those of `broker.errors`."""

from __future__ import annotations

from proto.errors import CallboardError


class AccessFileError(CallboardError, ValueError):
    """The file of access rules is broken, or cannot be read or written; the text names it and the place."""
