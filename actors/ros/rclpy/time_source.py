"""Simulated time: a node follows `/clock` while its parameter `use_sim_time` is set; so can other clocks."""

from __future__ import annotations

import weakref
from typing import TYPE_CHECKING, Final, cast

from actors.interfaces.rcl_interfaces.msg import SetParametersResult
from actors.interfaces.rosgraph_msgs.msg import Clock as ClockMessage
from actors.ros.rclpy.clock import ROSClock
from actors.ros.rclpy.qos import QoSProfile, ReliabilityPolicy
from actors.time.types import ClockType, Time
from actors.ros.rclpy.imported_names import imported_names

if TYPE_CHECKING:
    from collections.abc import Iterable

    from actors.ros.rclpy.node import Node
    from actors.ros.rclpy.parameter import Parameter
    from actors.ros.rclpy.subscription import Subscription

CLOCK_TOPIC: Final = "/clock"
USE_SIM_TIME_NAME: Final = "use_sim_time"

__getattr__ = imported_names(__name__, "Node Parameter")


class TimeSource:
    """Sets clocks that a program has made, as a node sets its own.

    Args:
        node: The node whose parameter and whose `/clock` count; None for none until `attach_node`.
    """

    def __init__(self, *, node: Node | None = None) -> None:
        self._node: weakref.ref[Node] | None = None
        self._clock_sub: Subscription[ClockMessage] | None = None
        self._clocks: set[ROSClock] = set()
        self._last = Time(clock_type=ClockType.ROS_TIME)
        self._active = False
        if node is not None:
            self.attach_node(node)

    @property
    def ros_time_is_active(self) -> bool:
        """Whether the clocks show simulated time."""
        return self._active

    @ros_time_is_active.setter
    def ros_time_is_active(self, enabled: bool) -> None:
        if enabled is self._active:
            return
        self._active = enabled
        for clock in self._clocks:
            clock._set_ros_time_is_active(enabled)  # noqa: SLF001 # pyright: ignore[reportPrivateUsage]
        if enabled:
            self._subscribe()
        else:
            self._unsubscribe()

    def attach_node(self, node: Node) -> None:
        """Follow the parameter and the `/clock` of a node, and of no other.

        Raises:
            TypeError: It is no node.
        """
        if not hasattr(node, "create_subscription"):
            raise TypeError(f"a time source follows an rclpy.node.Node, got {type(node).__name__}")
        self.detach_node()
        self._node = weakref.ref(node)
        if not node.has_parameter(USE_SIM_TIME_NAME):
            node.declare_parameter(USE_SIM_TIME_NAME, value=False)
        value = node.get_parameter(USE_SIM_TIME_NAME).value
        if isinstance(value, bool):
            self.ros_time_is_active = value
        node.add_on_set_parameters_callback(self._on_parameters)

    def detach_node(self) -> None:
        """Follow no node. The clocks stay as they are."""
        self._unsubscribe()
        self._node = None

    def attach_clock(self, clock: ROSClock) -> None:
        """Set a clock from now on.

        Raises:
            ValueError: It is not of ROS time.
        """
        if not isinstance(cast("object", clock), ROSClock):
            raise ValueError("only clocks of ROS time can be set")  # noqa: TRY004 - rclpy's
        clock.set_ros_time_override(self._last)
        clock._set_ros_time_is_active(self._active)  # noqa: SLF001 # pyright: ignore[reportPrivateUsage]
        self._clocks.add(clock)

    def clock_callback(self, msg: ClockMessage) -> None:
        """Set the clocks to the time of a message of `/clock`."""
        self._last = Time.from_msg(msg.clock)
        for clock in self._clocks:
            clock.set_ros_time_override(self._last)

    def _get_node(self) -> Node | None:
        return None if self._node is None else self._node()

    def _subscribe(self) -> None:
        node = self._get_node()
        if node is not None and self._clock_sub is None:
            profile = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
            self._clock_sub = node.create_subscription(
                ClockMessage, CLOCK_TOPIC, self.clock_callback, profile
            )

    def _unsubscribe(self) -> None:
        node = self._get_node()
        if node is not None and self._clock_sub is not None:
            node.destroy_subscription(self._clock_sub)
        self._clock_sub = None

    def _on_parameters(self, parameters: Iterable[Parameter]) -> SetParametersResult:
        for each in parameters:
            if each.name == USE_SIM_TIME_NAME and isinstance(each.value, bool):
                self.ros_time_is_active = each.value
        return SetParametersResult(successful=True)
