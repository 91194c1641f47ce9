"""What goes wrong in a measurement.

CallboardError (proto.errors)
└── TrialError                  a trial has no figures: a role or server failed, or messages were lost
"""

from __future__ import annotations

from proto.errors import CallboardError


class TrialError(CallboardError):
    """A trial gave no figures that count; the text says why."""
