"""Nodes in a thread of their own, for programs without asyncio: GUIs, notebooks, SDKs with callback threads.

Imports `runtime/` and the packages below it.
"""

from __future__ import annotations

from actors.lazy import lazy_imports

_RENAMED = {"ThreadStoppedError": "ThreadStopped", "TooManyCallsError": "TooManyCalls"}

with lazy_imports(__name__, renamed=_RENAMED):
    from actors.threads.errors import ThreadStopped as ThreadStopped
    from actors.threads.errors import TooManyCalls as TooManyCalls
    from actors.threads.node_thread import NodeThread as NodeThread
    from actors.threads.publisher import ThreadPublisher as ThreadPublisher
