"""Errors of nodes in a thread.

CallboardError
├── ThreadStoppedError (RuntimeError)   the thread does not run, or has ended during a call
└── TooManyCallsError (RuntimeError)    too many calls of other threads have not ended
"""

from __future__ import annotations

from proto.errors import CallboardError


class ThreadStoppedError(CallboardError, RuntimeError):
    """The thread does not run, or ended during the call. If a node's failure ended it, that is the cause."""


class TooManyCallsError(CallboardError, RuntimeError):
    """Too many calls into the loop have not ended; this one was not made."""
