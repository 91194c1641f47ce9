"""Names that programs import from a module of rclpy which only imports them itself.

`from rclpy.node import Parameter` is common, and works with ROS 2. The modules of the names are loaded when a
name is used.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.lazy import lazy_getattr

if TYPE_CHECKING:
    from collections.abc import Callable

# By module and not by name: each home is written once, and the modules that use a name need not know it.
NAMES_BY_HOME: Final = {
    "actors.interfaces.action_msgs.msg": "GoalInfo GoalStatus",
    "actors.interfaces.action_msgs.srv": "CancelGoal",
    "actors.interfaces.rcl_interfaces.msg": (
        "FloatingPointRange IntegerRange ListParametersResult ParameterDescriptor ParameterEvent"
        " ParameterType ParameterValue SetParametersResult"
    ),
    "actors.interfaces.rcl_interfaces.srv": (
        "DescribeParameters GetParameterTypes GetParameters ListParameters SetParameters"
        " SetParametersAtomically"
    ),
    "actors.interfaces.unique_identifier_msgs.msg": "UUID",
    "actors.ros.rclpy.callback_groups": "CallbackGroup",
    "actors.ros.rclpy.client": "Client",
    "actors.ros.rclpy.clock": "Clock ROSClock",
    "actors.ros.rclpy.clock_type": "ClockType",
    "actors.ros.rclpy.constants": "S_TO_NS",
    "actors.ros.rclpy.context": "Context",
    "actors.ros.rclpy.duration": "Duration",
    "actors.ros.rclpy.event_handler": "PublisherEventCallbacks SubscriptionEventCallbacks",
    "actors.ros.rclpy.exceptions": (
        "InvalidHandle InvalidParameterTypeException InvalidParameterValueException"
        " InvalidTopicNameException NotInitializedException ParameterAlreadyDeclaredException"
        " ParameterImmutableException ParameterNotDeclaredException ParameterUninitializedException"
    ),
    "actors.ros.rclpy.executors": "Executor await_or_execute",
    "actors.ros.rclpy.expand_topic_name": "expand_topic_name",
    "actors.ros.rclpy.guard_condition": "GuardCondition",
    "actors.ros.rclpy.impl.logging_severity": "LoggingSeverity",
    "actors.ros.rclpy.impl.rcutils_logger": "RcutilsLogger",
    "actors.ros.rclpy.logging": "get_logger",
    "actors.ros.rclpy.node": "Node",
    "actors.ros.rclpy.parameter": "PARAMETER_SEPARATOR_STRING Parameter",
    "actors.ros.rclpy.qos": (
        "QoSProfile qos_profile_action_status_default qos_profile_parameter_events"
        " qos_profile_services_default"
    ),
    "actors.ros.rclpy.qos_overriding_options": "QoSOverridingOptions",
    "actors.ros.rclpy.service": "Service",
    "actors.ros.rclpy.service_introspection": "ServiceIntrospectionState",
    "actors.ros.rclpy.subscription": "MessageInfo Subscription",
    "actors.ros.rclpy.task": "Future",
    "actors.ros.rclpy.timer": "Timer TimerInfo",
    "actors.ros.rclpy.topic_endpoint_info": "TopicEndpointInfo",
    "actors.ros.rclpy.type_support": "MsgType SrvType SrvTypeRequest SrvTypeResponse",
    "actors.ros.rclpy.utilities": "get_default_context timeout_sec_to_nsec",
    "actors.ros.rclpy.validate_full_topic_name": "validate_full_topic_name",
    "actors.ros.rclpy.validate_namespace": "validate_namespace",
    "actors.ros.rclpy.validate_node_name": "validate_node_name",
    "actors.ros.rclpy.validate_parameter_name": "validate_parameter_name",
    "actors.ros.rclpy.validate_topic_name": "validate_topic_name",
    "actors.ros.rclpy.waitable": "NumberOfEntities Waitable",
}
_HOMES: Final = {name: module for module, names in NAMES_BY_HOME.items() for name in names.split()}


def imported_names(module: str, names: str) -> Callable[[str], object]:
    """Return the `__getattr__` of a module.

    Args:
        module: Its `__name__`.
        names: The names that rclpy's module imports, separated by spaces.
    """
    return lazy_getattr(module, {name: _HOMES[name] for name in names.split()})
