"""Errors of bridges.

CallboardError (proto.errors)
└── InvalidBridgeOptionError    a rule or an option of a bridge is wrong
"""

from __future__ import annotations

from proto.errors import CallboardError


class InvalidBridgeOptionError(CallboardError, ValueError):
    """A rule or an option of a bridge is wrong; the text names it and says what is allowed."""
