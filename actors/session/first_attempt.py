"""The wait of a node, when it is entered, for its first attempt to connect.

When one node has waited in vain, other nodes of the loop do not wait for the same brokers until these answer,
a node that tries them ends, or some seconds have passed: many nodes entered one after the other wait once.
"""

from __future__ import annotations

import asyncio
import weakref
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.session.link import Link
    from proto.wire.url import BrokerUrl

FIRST_ANSWER_SEC: Final = 1.0
"""The longest wait; a broker needs milliseconds to answer."""

_silent: Final[weakref.WeakKeyDictionary[asyncio.AbstractEventLoop, dict[tuple[BrokerUrl, ...], float]]] = (
    weakref.WeakKeyDictionary()
)
"""By loop and brokers: the loop time until which no node waits for their first answer."""


async def wait(
    link: Link, urls: tuple[BrokerUrl, ...], attempt_ended: Callable[[], bool], *, again_after_sec: float
) -> None:
    """Wait until `attempt_ended`, at most `FIRST_ANSWER_SEC`; not at all after a vain wait of another node.

    Args:
        link: Its changes wake this coroutine.
        urls: The brokers.
        attempt_ended: Whether the attempt has ended.
        again_after_sec: Seconds after a failed wait in which no node waits for these brokers.
    """
    loop = asyncio.get_running_loop()
    silent = _silent.setdefault(loop, {})
    if silent.get(urls, 0.0) > loop.time():
        return
    try:
        async with asyncio.timeout(FIRST_ANSWER_SEC):
            while not attempt_ended():
                await link.changed()
    except TimeoutError:
        silent[urls] = loop.time() + again_after_sec


def wait_again(loop: asyncio.AbstractEventLoop, urls: tuple[BrokerUrl, ...]) -> None:
    """Let nodes wait for these brokers again: one has answered, or a node that tries them has ended."""
    _silent.get(loop, {}).pop(urls, None)
