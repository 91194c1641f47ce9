"""Waits for one message, without spinning."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal, TypeVar

from actors.interfaces.message import Message
from actors.ros.rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from actors.ros.rclpy.node import Node
from actors.ros.rclpy.task import Future

if TYPE_CHECKING:
    from actors.ros.rclpy.qos import QoSProfile

MsgT = TypeVar("MsgT", bound=Message)


def wait_for_message(
    msg_type: type[MsgT],
    node: Node,
    topic: str,
    *,
    qos_profile: QoSProfile | int = 1,
    time_to_wait: float = -1,
) -> tuple[Literal[True], MsgT] | tuple[Literal[False], None]:
    """Wait for the next message on a topic.

    Args:
        msg_type: The message class.
        node: Its context, namespace and remapping rules are used; its own callbacks do not run.
        topic: The topic's name.
        qos_profile: A profile or a depth.
        time_to_wait: Seconds; negative for no limit.

    Returns:
        True and the message, or False and None if none came in time or the context was shut down.
    """
    context, name = node.context, node.resolve_topic_name(topic)
    future = Future[Any]()
    waiter = Node("_wait_for_message", context=context, use_global_arguments=False, enable_rosout=False)
    try:
        # The executor first: none is made any more when another thread has shut the context down, which may
        # happen as soon as others see the subscription.
        with SingleThreadedExecutor(context=context) as executor:
            waiter.create_subscription(msg_type, name, future.set_result, qos_profile)
            executor.add_node(waiter)
            executor.spin_until_future_complete(future, time_to_wait)
    except ExternalShutdownException:
        return False, None
    finally:
        waiter.destroy_node()
    if not future.done():
        return False, None
    message: Any = future.result()
    return True, message
