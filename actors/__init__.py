"""Nodes, topics, services and timers on asyncio: callboard's public API.

    import actors
    from actors.interfaces.std_msgs.msg import String

The names below load their modules when they are first used.
"""

from __future__ import annotations

from importlib.machinery import PathFinder as _PathFinder

from actors.lazy import lazy_imports

# Somebody's own proto.py, or another library, would give errors that nobody understands.
_spec = _PathFinder.find_spec("proto")
if _spec is None or _spec.origin != "proto".join(__file__.rsplit("actors", 1)):
    from actors.hidden_packages import refuse_without_proto

    refuse_without_proto()

_RENAMED = {
    "InvalidGoalTransition": "InvalidGoalTransitionError",
    "NodeAlreadyRunning": "NodeAlreadyRunningError",
    "TimeSourceChangedError": "TimeSourceChanged",
}

with lazy_imports(__name__, renamed=_RENAMED):
    from actors.actions.client import ActionClient as ActionClient
    from actors.actions.client_goal import ClientGoalHandle as ClientGoalHandle
    from actors.actions.client_goal import GoalResult as GoalResult
    from actors.actions.server import ActionServer as ActionServer
    from actors.actions.server_callbacks import CancelResponse as CancelResponse
    from actors.actions.server_callbacks import GoalResponse as GoalResponse
    from actors.actions.server_goal import ServerGoalHandle as ServerGoalHandle
    from actors.actions.states import GoalState as GoalState
    from actors.arguments.ros_arguments import InvalidRosArgumentError as InvalidRosArgumentError
    from actors.arguments.ros_arguments import RosArguments as RosArguments
    from actors.arguments.ros_arguments import parse_ros_arguments as parse_ros_arguments
    from actors.diagnostics.records import NodeDiagnostics as NodeDiagnostics
    from actors.diagnostics.records import NodeRates as NodeRates
    from actors.endpoints.client.client import Client as Client
    from actors.endpoints.events import DeadlineMissedInfo as DeadlineMissedInfo
    from actors.endpoints.events import IncompatibleQoSInfo as IncompatibleQoSInfo
    from actors.endpoints.events import IncompatibleTypeInfo as IncompatibleTypeInfo
    from actors.endpoints.events import LivelinessChangedInfo as LivelinessChangedInfo
    from actors.endpoints.events import LivelinessLostInfo as LivelinessLostInfo
    from actors.endpoints.events import MatchedInfo as MatchedInfo
    from actors.endpoints.events import MessageLostInfo as MessageLostInfo
    from actors.endpoints.events import PublisherEventCallbacks as PublisherEventCallbacks
    from actors.endpoints.events import SubscriptionEventCallbacks as SubscriptionEventCallbacks
    from actors.endpoints.publisher.publisher import Publisher as Publisher
    from actors.endpoints.service.service import ServiceServer as ServiceServer
    from actors.endpoints.service_introspection import ServiceIntrospectionState as ServiceIntrospectionState
    from actors.endpoints.subscription.backlog import MessageInfo as MessageInfo
    from actors.endpoints.subscription.subscription import Subscription as Subscription
    from actors.endpoints.timer import Timer as Timer
    from actors.endpoints.timer import TimerInfo as TimerInfo
    from actors.errors import BrokerUnreachable as BrokerUnreachable
    from actors.errors import CallCancelled as CallCancelled
    from actors.errors import CallFailed as CallFailed
    from actors.errors import GoalRejected as GoalRejected
    from actors.errors import GoalUnknown as GoalUnknown
    from actors.errors import InvalidGoalTransitionError as InvalidGoalTransitionError
    from actors.errors import NodeAlreadyRunningError as NodeAlreadyRunningError
    from actors.errors import NodeDestroyed as NodeDestroyed
    from actors.errors import NodeNameTaken as NodeNameTaken
    from actors.errors import NotAuthorized as NotAuthorized
    from actors.errors import PublisherFull as PublisherFull
    from actors.errors import PublisherRefused as PublisherRefused
    from actors.errors import RemoteError as RemoteError
    from actors.errors import ServiceOverloaded as ServiceOverloaded
    from actors.errors import ServiceTimeout as ServiceTimeout
    from actors.errors import ServiceUnavailable as ServiceUnavailable
    from actors.errors import SupervisorGaveUp as SupervisorGaveUp
    from actors.errors import TimeSourceChanged as TimeSourceChanged
    from actors.errors import TlsFailed as TlsFailed
    from actors.errors import WaitTimeout as WaitTimeout
    from actors.graph.broker_report import BrokerReport as BrokerReport
    from actors.graph.broker_report import BrokerReportRates as BrokerReportRates
    from actors.graph.changes import GraphChange as GraphChange
    from actors.graph.changes import GraphChangeKind as GraphChangeKind
    from actors.graph.changes import GraphWatch as GraphWatch
    from actors.graph.inspector import Inspector as Inspector
    from actors.graph.snapshot import EndpointInfo as EndpointInfo
    from actors.graph.snapshot import GraphSnapshot as GraphSnapshot
    from actors.interfaces.errors import InvalidMessageError as InvalidMessageError
    from actors.interfaces.message import Action as Action
    from actors.interfaces.message import Message as Message
    from actors.interfaces.message import Service as Service
    from actors.lifecycle.errors import InvalidTransitionError as InvalidTransitionError
    from actors.lifecycle.node import LifecycleNode as LifecycleNode
    from actors.lifecycle.publisher import LifecyclePublisher as LifecyclePublisher
    from actors.lifecycle.states import LifecycleState as LifecycleState
    from actors.lifecycle.states import TransitionCallbackReturn as TransitionCallbackReturn
    from actors.logging.logger import Logger as Logger
    from actors.logging.logger import get_logger as get_logger
    from actors.logging.output import configure_logging as configure_logging
    from actors.logging.severity import LoggingSeverity as LoggingSeverity
    from actors.node.bare_node import BareNode as BareNode
    from actors.node.decorators import service as service
    from actors.node.decorators import subscription as subscription
    from actors.node.decorators import timer as timer
    from actors.node.node import Node as Node
    from actors.node.options import NodeOptions as NodeOptions
    from actors.node.qos_overrides import QoSOverridingOptions as QoSOverridingOptions
    from actors.node.wait_for_message import wait_for_message as wait_for_message
    from actors.parameter_client.client import ParameterClient as ParameterClient
    from actors.parameter_client.event_handler import ParameterEventHandler as ParameterEventHandler
    from actors.parameters.errors import InvalidParameterError as InvalidParameterError
    from actors.parameters.errors import InvalidParameterFileError as InvalidParameterFileError
    from actors.parameters.errors import InvalidParameterTypeError as InvalidParameterTypeError
    from actors.parameters.errors import InvalidParameterValueError as InvalidParameterValueError
    from actors.parameters.errors import ParameterAlreadyDeclaredError as ParameterAlreadyDeclaredError
    from actors.parameters.errors import ParameterImmutableError as ParameterImmutableError
    from actors.parameters.errors import ParameterModifiedInCallbackError as ParameterModifiedInCallbackError
    from actors.parameters.errors import ParameterNotDeclaredError as ParameterNotDeclaredError
    from actors.parameters.errors import ParameterUninitializedError as ParameterUninitializedError
    from actors.parameters.types import FloatingPointRange as FloatingPointRange
    from actors.parameters.types import IntegerRange as IntegerRange
    from actors.parameters.types import ListParametersResult as ListParametersResult
    from actors.parameters.types import Parameter as Parameter
    from actors.parameters.types import ParameterDescriptor as ParameterDescriptor
    from actors.parameters.types import ParameterType as ParameterType
    from actors.parameters.types import SetParametersResult as SetParametersResult
    from actors.processes.child import Child as Child
    from actors.processes.child import Restart as Restart
    from actors.processes.child import Strategy as Strategy
    from actors.processes.child_events import ChildEvent as ChildEvent
    from actors.processes.child_events import ChildEventKind as ChildEventKind
    from actors.processes.child_events import ChildEventMessage as ChildEventMessage
    from actors.processes.child_events import ChildEvents as ChildEvents
    from actors.processes.outcome import Outcome as Outcome
    from actors.processes.restart_plan import ChildState as ChildState
    from actors.processes.supervisor import ChildStatus as ChildStatus
    from actors.processes.supervisor import Supervisor as Supervisor
    from actors.qos.compatibility import QoSCompatibility as QoSCompatibility
    from actors.qos.compatibility import QoSPolicyKind as QoSPolicyKind
    from actors.qos.compatibility import qos_check_compatible as qos_check_compatible
    from actors.qos.profile import DurabilityPolicy as DurabilityPolicy
    from actors.qos.profile import HistoryPolicy as HistoryPolicy
    from actors.qos.profile import InvalidQoSProfileError as InvalidQoSProfileError
    from actors.qos.profile import LivelinessPolicy as LivelinessPolicy
    from actors.qos.profile import QoSProfile as QoSProfile
    from actors.qos.profile import ReliabilityPolicy as ReliabilityPolicy
    from actors.qos.profile import qos_profile_default as qos_profile_default
    from actors.qos.profile import qos_profile_sensor_data as qos_profile_sensor_data
    from actors.qos.profile import qos_profile_services_default as qos_profile_services_default
    from actors.runtime.run import run as run
    from actors.time.clock import Clock as Clock
    from actors.time.jumps import ClockChange as ClockChange
    from actors.time.jumps import JumpHandle as JumpHandle
    from actors.time.jumps import JumpThreshold as JumpThreshold
    from actors.time.jumps import TimeJump as TimeJump
    from actors.time.rate import Rate as Rate
    from actors.time.timeout import DEFAULT_TIMEOUT as DEFAULT_TIMEOUT
    from actors.time.timeout import DefaultTimeout as DefaultTimeout
    from actors.time.types import ClockType as ClockType
    from actors.time.types import Duration as Duration
    from actors.time.types import Time as Time
    from proto.errors import CallboardError as CallboardError
    from proto.errors import InvalidNameError as InvalidNameError
    from proto.errors import InvalidNamespaceError as InvalidNamespaceError
    from proto.errors import InvalidNodeNameError as InvalidNodeNameError
    from proto.errors import InvalidServiceNameError as InvalidServiceNameError
    from proto.errors import InvalidTopicNameError as InvalidTopicNameError
    from proto.errors import InvalidUrlError as InvalidUrlError
    from proto.errors import TlsFileError as TlsFileError
    from proto.wire.codes import EntryKind as EntryKind
    from proto.wire.stats import BrokerRates as BrokerRates
    from proto.wire.stats import BrokerStats as BrokerStats
    from proto.wire.stats import LinkStats as LinkStats
    from proto.wire.stats import MeshBrokerStats as MeshBrokerStats
    from proto.wire.stats import MeshStats as MeshStats
    from proto.wire.stats import TopicStats as TopicStats
