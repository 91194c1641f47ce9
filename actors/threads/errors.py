"""Errors of nodes in a thread.

CallboardError
├── ThreadStopped (RuntimeError)  the thread does not run, or has ended during a call
└── TooManyCalls (RuntimeError)   too many calls of other threads have not ended
"""

from __future__ import annotations

from proto.errors import CallboardError


class ThreadStopped(CallboardError, RuntimeError):
    """The thread does not run, or ended during the call. If a node's failure ended it, that is the cause."""


class TooManyCalls(CallboardError, RuntimeError):
    """Too many calls into the loop have not ended; this one was not made."""
