"""Nodes in a thread of their own, for programs without asyncio: GUIs, notebooks, SDKs with callback threads.

Imports `runtime/` and the packages below it.
"""

from __future__ import annotations

from actors.lazy import lazy_imports

with lazy_imports(__name__):
    from actors.threads.errors import ThreadStoppedError as ThreadStoppedError
    from actors.threads.errors import TooManyCallsError as TooManyCallsError
    from actors.threads.node_thread import NodeThread as NodeThread
    from actors.threads.publisher import ThreadPublisher as ThreadPublisher
