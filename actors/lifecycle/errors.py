"""Errors of nodes with states.

CallboardError
└── InvalidTransitionError   the state has no such transition, or another transition runs
"""

from __future__ import annotations

from proto.errors import CallboardError


class InvalidTransitionError(CallboardError):
    """A transition is not possible in the state that the node is in; the node stays in that state."""
