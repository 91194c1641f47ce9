"""A node's queries to its broker: wait for a session, ask, and wait for that session's answer."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.errors import BrokerUnreachable, WaitTimeout

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.endpoints.context import NodeContext

QUERY_TIMEOUT_SEC: Final = 5.0


async def connected(context: NodeContext, timeout_sec: float) -> float:
    """Wait until there is a session; return how much of `timeout_sec` is left for the answer.

    Raises:
        BrokerUnreachable: There is none within `timeout_sec`.
    """
    link = context.link
    deadline = context.require_loop().time() + timeout_sec
    try:
        await context.wait_until(lambda: link.connected, "Connecting", timeout_sec)
    except WaitTimeout as error:
        raise BrokerUnreachable(f"No broker at {link.broker_urls}") from error
    return deadline - context.require_loop().time()


async def answered(
    context: NodeContext, condition: Callable[[], bool], session: int, timeout_sec: float
) -> None:
    """Wait until the broker has answered a query of a session.

    Raises:
        BrokerUnreachable: It did not within `timeout_sec`, or the link broke meanwhile.
    """
    link = context.link
    try:
        await context.wait_until(
            lambda: condition() or link.connections != session or not link.connected,
            "The broker's answer",
            timeout_sec,
        )
    except WaitTimeout as error:
        raise BrokerUnreachable(f"No answer from the broker at {link.broker_urls}") from error
    if not condition():
        raise BrokerUnreachable(f"The link to the broker at {link.broker_urls} broke")
