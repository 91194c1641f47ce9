"""Nodes, topics, services and timers on asyncio: callboard's public API.

    import actors
    from actors.interfaces.std_msgs.msg import String

The names below load their modules when they are first used.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from actors.lazy import lazy_names

if TYPE_CHECKING:
    from actors.arguments import InvalidRosArgumentError as InvalidRosArgumentError
    from actors.arguments import RosArguments as RosArguments
    from actors.arguments import parse_ros_arguments as parse_ros_arguments
    from actors.broker_report import BrokerReport as BrokerReport
    from actors.broker_report import BrokerReportRates as BrokerReportRates
    from actors.clock import Clock as Clock
    from actors.decorators import service as service
    from actors.decorators import subscription as subscription
    from actors.decorators import timer as timer
    from actors.diagnostics import NodeDiagnostics as NodeDiagnostics
    from actors.diagnostics import NodeRates as NodeRates
    from actors.entities.backlog import MessageInfo as MessageInfo
    from actors.entities.client import Client as Client
    from actors.entities.publisher import Publisher as Publisher
    from actors.entities.subscription import Subscription as Subscription
    from actors.entities.timer import Timer as Timer
    from actors.entities.timer import TimerInfo as TimerInfo
    from actors.errors import BrokerUnreachable as BrokerUnreachable
    from actors.errors import CallFailed as CallFailed
    from actors.errors import NodeAlreadyRunning as NodeAlreadyRunning
    from actors.errors import NodeDestroyed as NodeDestroyed
    from actors.errors import NodeNameTaken as NodeNameTaken
    from actors.errors import PublisherFull as PublisherFull
    from actors.errors import PublisherRefused as PublisherRefused
    from actors.errors import RemoteError as RemoteError
    from actors.errors import ServiceOverloaded as ServiceOverloaded
    from actors.errors import ServiceTimeout as ServiceTimeout
    from actors.errors import ServiceUnavailable as ServiceUnavailable
    from actors.errors import SupervisorGaveUp as SupervisorGaveUp
    from actors.errors import WaitTimeout as WaitTimeout
    from actors.events import DeadlineMissedInfo as DeadlineMissedInfo
    from actors.events import IncompatibleQoSInfo as IncompatibleQoSInfo
    from actors.events import IncompatibleTypeInfo as IncompatibleTypeInfo
    from actors.events import LivelinessChangedInfo as LivelinessChangedInfo
    from actors.events import LivelinessLostInfo as LivelinessLostInfo
    from actors.events import MatchedInfo as MatchedInfo
    from actors.events import MessageLostInfo as MessageLostInfo
    from actors.events import PublisherEventCallbacks as PublisherEventCallbacks
    from actors.events import SubscriptionEventCallbacks as SubscriptionEventCallbacks
    from actors.graph_changes import GraphChange as GraphChange
    from actors.graph_changes import GraphChangeKind as GraphChangeKind
    from actors.graph_changes import GraphWatch as GraphWatch
    from actors.inspector import Inspector as Inspector
    from actors.interfaces.errors import InvalidMessageError as InvalidMessageError
    from actors.interfaces.message import Action as Action
    from actors.interfaces.message import Message as Message
    from actors.interfaces.message import Service as Service
    from actors.log_output import configure_logging as configure_logging
    from actors.logger import Logger as Logger
    from actors.logger import LoggingSeverity as LoggingSeverity
    from actors.logger import get_logger as get_logger
    from actors.node import Node as Node
    from actors.parameter_errors import InvalidParameterError as InvalidParameterError
    from actors.parameter_errors import InvalidParameterTypeError as InvalidParameterTypeError
    from actors.parameter_errors import InvalidParameterValueError as InvalidParameterValueError
    from actors.parameter_errors import ParameterAlreadyDeclaredError as ParameterAlreadyDeclaredError
    from actors.parameter_errors import ParameterImmutableError as ParameterImmutableError
    from actors.parameter_errors import ParameterNotDeclaredError as ParameterNotDeclaredError
    from actors.parameter_errors import ParameterUninitializedError as ParameterUninitializedError
    from actors.parameter_types import Parameter as Parameter
    from actors.parameter_types import ParameterDescriptor as ParameterDescriptor
    from actors.parameter_types import ParameterType as ParameterType
    from actors.parameters import SetParametersResult as SetParametersResult
    from actors.picture import EndpointInfo as EndpointInfo
    from actors.picture import GraphPicture as GraphPicture
    from actors.qos import DurabilityPolicy as DurabilityPolicy
    from actors.qos import HistoryPolicy as HistoryPolicy
    from actors.qos import InvalidQoSProfileError as InvalidQoSProfileError
    from actors.qos import LivelinessPolicy as LivelinessPolicy
    from actors.qos import QoSProfile as QoSProfile
    from actors.qos import ReliabilityPolicy as ReliabilityPolicy
    from actors.qos import qos_profile_default as qos_profile_default
    from actors.qos import qos_profile_sensor_data as qos_profile_sensor_data
    from actors.qos import qos_profile_services_default as qos_profile_services_default
    from actors.qos_compatibility import QoSCompatibility as QoSCompatibility
    from actors.qos_compatibility import QoSPolicyKind as QoSPolicyKind
    from actors.qos_compatibility import qos_check_compatible as qos_check_compatible
    from actors.running import run as run
    from actors.service_introspection import ServiceIntrospectionState as ServiceIntrospectionState
    from actors.supervision.events import ChildEvent as ChildEvent
    from actors.supervision.events import ChildEventKind as ChildEventKind
    from actors.supervision.events import ChildEventMessage as ChildEventMessage
    from actors.supervision.events import ChildEvents as ChildEvents
    from actors.supervision.outcome import Outcome as Outcome
    from actors.supervision.plan import ChildState as ChildState
    from actors.supervision.specification import Child as Child
    from actors.supervision.specification import Restart as Restart
    from actors.supervision.specification import Strategy as Strategy
    from actors.supervision.supervisor import ChildStatus as ChildStatus
    from actors.supervision.supervisor import Supervisor as Supervisor
    from actors.time_types import ClockType as ClockType
    from actors.time_types import Duration as Duration
    from actors.time_types import Time as Time
    from proto.codes import EntryKind as EntryKind
    from proto.errors import CallboardError as CallboardError
    from proto.errors import InvalidNameError as InvalidNameError
    from proto.errors import InvalidNamespaceError as InvalidNamespaceError
    from proto.errors import InvalidNodeNameError as InvalidNodeNameError
    from proto.errors import InvalidServiceNameError as InvalidServiceNameError
    from proto.errors import InvalidTopicNameError as InvalidTopicNameError
    from proto.errors import InvalidUrlError as InvalidUrlError
    from proto.stats import BrokerRates as BrokerRates
    from proto.stats import BrokerStats as BrokerStats
    from proto.stats import LinkStats as LinkStats
    from proto.stats import TopicStats as TopicStats

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "actors.arguments": (
            "InvalidRosArgumentError",
            "RosArguments",
            "parse_ros_arguments",
        ),
        "actors.broker_report": (
            "BrokerReport",
            "BrokerReportRates",
        ),
        "actors.entities.client": ("Client",),
        "actors.clock": ("Clock",),
        "actors.time_types": (
            "ClockType",
            "Duration",
            "Time",
        ),
        "actors.diagnostics": (
            "NodeDiagnostics",
            "NodeRates",
        ),
        "actors.decorators": (
            "service",
            "subscription",
            "timer",
        ),
        "actors.errors": (
            "BrokerUnreachable",
            "CallFailed",
            "NodeAlreadyRunning",
            "NodeDestroyed",
            "NodeNameTaken",
            "PublisherFull",
            "PublisherRefused",
            "RemoteError",
            "ServiceOverloaded",
            "ServiceTimeout",
            "ServiceUnavailable",
            "SupervisorGaveUp",
            "WaitTimeout",
        ),
        "actors.events": (
            "DeadlineMissedInfo",
            "IncompatibleQoSInfo",
            "IncompatibleTypeInfo",
            "LivelinessChangedInfo",
            "LivelinessLostInfo",
            "MatchedInfo",
            "MessageLostInfo",
            "PublisherEventCallbacks",
            "SubscriptionEventCallbacks",
        ),
        "actors.picture": (
            "EndpointInfo",
            "GraphPicture",
        ),
        "actors.graph_changes": (
            "GraphChange",
            "GraphChangeKind",
            "GraphWatch",
        ),
        "actors.inspector": ("Inspector",),
        "actors.interfaces.errors": ("InvalidMessageError",),
        "actors.interfaces.message": (
            "Action",
            "Message",
            "Service",
        ),
        "actors.log_output": ("configure_logging",),
        "actors.logger": (
            "Logger",
            "LoggingSeverity",
            "get_logger",
        ),
        "actors.node": ("Node",),
        "actors.parameter_errors": (
            "InvalidParameterError",
            "InvalidParameterTypeError",
            "InvalidParameterValueError",
            "ParameterAlreadyDeclaredError",
            "ParameterImmutableError",
            "ParameterNotDeclaredError",
            "ParameterUninitializedError",
        ),
        "actors.parameter_types": (
            "Parameter",
            "ParameterDescriptor",
            "ParameterType",
        ),
        "actors.parameters": ("SetParametersResult",),
        "actors.entities.publisher": ("Publisher",),
        "actors.qos": (
            "DurabilityPolicy",
            "HistoryPolicy",
            "InvalidQoSProfileError",
            "LivelinessPolicy",
            "QoSProfile",
            "ReliabilityPolicy",
            "qos_profile_default",
            "qos_profile_sensor_data",
            "qos_profile_services_default",
        ),
        "actors.qos_compatibility": (
            "QoSCompatibility",
            "QoSPolicyKind",
            "qos_check_compatible",
        ),
        "actors.running": ("run",),
        "actors.service_introspection": ("ServiceIntrospectionState",),
        "actors.entities.backlog": ("MessageInfo",),
        "actors.entities.subscription": ("Subscription",),
        "actors.supervision.events": (
            "ChildEvent",
            "ChildEventKind",
            "ChildEventMessage",
            "ChildEvents",
        ),
        "actors.supervision.outcome": ("Outcome",),
        "actors.supervision.plan": ("ChildState",),
        "actors.supervision.specification": (
            "Child",
            "Restart",
            "Strategy",
        ),
        "actors.supervision.supervisor": (
            "ChildStatus",
            "Supervisor",
        ),
        "actors.entities.timer": (
            "Timer",
            "TimerInfo",
        ),
        "proto.errors": (
            "CallboardError",
            "InvalidNameError",
            "InvalidNamespaceError",
            "InvalidNodeNameError",
            "InvalidServiceNameError",
            "InvalidTopicNameError",
            "InvalidUrlError",
        ),
        "proto.codes": ("EntryKind",),
        "proto.stats": (
            "BrokerRates",
            "BrokerStats",
            "LinkStats",
            "TopicStats",
        ),
    },
)
