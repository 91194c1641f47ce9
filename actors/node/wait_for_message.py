"""Waiting for one message of a topic, without a subscription of one's own."""

from __future__ import annotations

from contextlib import aclosing
from typing import TYPE_CHECKING, TypeVar

from actors.endpoints.context import in_flight, time_limit
from actors.endpoints.endpoint import endpoint_of
from actors.errors import NodeDestroyed, WaitTimeout
from actors.time.timeout import DEFAULT_TIMEOUT

if TYPE_CHECKING:
    from actors.interfaces.message import Message
    from actors.node.node import Node
    from actors.qos.profile import QoSProfile
    from actors.time.timeout import Timeout

MessageT = TypeVar("MessageT", bound="Message")


async def wait_for_message(
    msg_type: type[MessageT],
    node: Node,
    topic: str,
    timeout_sec: Timeout = DEFAULT_TIMEOUT,
    *,
    qos_profile: QoSProfile | int = 1,
) -> MessageT:
    """Return the next message of a topic, or the latched one if the profile is TRANSIENT_LOCAL.

    Args:
        msg_type: The message class.
        node: The node that subscribes meanwhile; it runs.
        topic: As for `Node.create_subscription`.
        timeout_sec: Seconds to wait at most; None for no limit.
        qos_profile: A profile or a depth.

    Returns:
        The message.

    Raises:
        WaitTimeout: There was none within `timeout_sec`.
        InvalidTopicNameError: The name breaks the rules.
        RuntimeError: The node does not run.
        NodeDestroyed: The node has been destroyed.
    """
    subscription = node.create_subscription(msg_type, topic, qos_profile=qos_profile)
    endpoint = endpoint_of(subscription)
    limit = endpoint.context.limit_sec(timeout_sec)
    try:
        # A callback that waits here lets the node's other callbacks run, as it does with a call; otherwise
        # the message could wait behind the callback that waits for it.
        with in_flight():
            async with time_limit(limit), aclosing(aiter(subscription)) as messages:
                async for message in messages:
                    return message
    except TimeoutError as error:
        raise WaitTimeout(f"No message on '{subscription.topic_name}' within {limit:g} s") from error
    finally:
        subscription.destroy()
    # The iteration ends without a message only if the subscription ends, and only the node's end does that.
    raise NodeDestroyed(f"Node '{node.get_fully_qualified_name()}' has been destroyed")
