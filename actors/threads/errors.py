"""Errors of nodes in a thread.

CallboardError
└── ThreadStoppedError (RuntimeError)   the thread has not been started, or has been stopped, or has failed
"""

from __future__ import annotations

from proto.errors import CallboardError


class ThreadStoppedError(CallboardError, RuntimeError):
    """The thread does not run, or ended during the call. If a node's failure ended it, that is the cause."""
