"""Nodes in a thread of their own, for programs without asyncio: GUIs, notebooks, SDKs with callback threads.

Imports `runtime/` and the packages below it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from actors.lazy import lazy_names

if TYPE_CHECKING:
    from actors.threads.errors import ThreadStoppedError as ThreadStoppedError
    from actors.threads.errors import TooManyCallsError as TooManyCallsError
    from actors.threads.node_thread import NodeThread as NodeThread
    from actors.threads.publisher import ThreadPublisher as ThreadPublisher

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "actors.threads.errors": (
            "ThreadStoppedError",
            "TooManyCallsError",
        ),
        "actors.threads.node_thread": ("NodeThread",),
        "actors.threads.publisher": ("ThreadPublisher",),
    },
)
