"""Errors of a measurement.

CallboardError (proto.errors)
└── TrialError                  a trial has no figures: a role or server failed, or messages were lost
"""

from __future__ import annotations

from proto.errors import CallboardError


class TrialError(CallboardError):
    """A trial has no valid figures; the text gives the reason."""
