"""Nodes. Each has a node of callboard in the process's thread; callbacks run where its executor spins."""

from __future__ import annotations

import weakref
from typing import TYPE_CHECKING, Any, ClassVar, Literal, Self, TypeVar, cast

from actors.endpoints.subscription.selection import select
from actors.interfaces.message import Message, is_message_type
from actors.ros.rclpy._rclpy_pybind11 import RCLError
from actors.ros.rclpy.callback_groups import (
    CallbackGroup,
    MutuallyExclusiveCallbackGroup,
    ReentrantCallbackGroup,
)
from actors.ros.rclpy.client import Client
from actors.ros.rclpy.clock import Clock
from actors.ros.rclpy.destroyable import DESTROYED, VALID, Destroyable, Handle
from actors.ros.rclpy.event_handler import EventCalls
from actors.ros.rclpy.exceptions import NotInitializedException
from actors.ros.rclpy.guard_condition import GuardCondition
from actors.ros.rclpy.node_graph import NodeGraph
from actors.ros.rclpy.node_parameters import NodeParameters
from actors.ros.rclpy.node_parts import NodeNameNonExistentError as NodeNameNonExistentError
from actors.ros.rclpy.node_parts import NodeParts, parts_of
from actors.ros.rclpy.parameter_services import publish_changes, serve_parameters
from actors.ros.rclpy.publisher import Publisher
from actors.ros.rclpy.qos import (
    QoSProfile,
    profile_of,
    qos_profile_rosout_default,
    qos_profile_services_default,
)
from actors.ros.rclpy.qos_overriding_options import overridden
from actors.ros.rclpy.service import Service
from actors.ros.rclpy.subscription import Subscription
from actors.ros.rclpy.timer import Rate, Timer
from actors.ros.rclpy.utilities import get_default_context
from actors.ros.rclpy.waitable import Waitable, WaitableEntity
from actors.ros.rclpy.imported_names import imported_names
from proto.errors import InvalidNameError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence
    from types import TracebackType

    from actors.logging.logger import Logger
    from actors.parameters.types import Parameter
    from actors.ros.rclpy.content_filter import ContentFilter
    from actors.ros.rclpy.context import Context
    from actors.ros.rclpy.entity import Entity, EntityExecutor
    from actors.ros.rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
    from actors.ros.rclpy.executors import Executor
    from actors.ros.rclpy.qos_overriding_options import QoSOverridingOptions
    from actors.ros.rclpy.subscription_content_filter_options import ContentFilterOptions

HIDDEN_NODE_PREFIX = "_"
MsgT = TypeVar("MsgT", bound=Message)

__getattr__ = imported_names(
    __name__,
    "Context Executor FloatingPointRange IntegerRange InvalidHandle "
    "InvalidParameterTypeException InvalidParameterValueException InvalidTopicNameException "
    "ListParametersResult MessageInfo MsgType PARAMETER_SEPARATOR_STRING Parameter "
    "ParameterAlreadyDeclaredException ParameterDescriptor ParameterEvent "
    "ParameterImmutableException ParameterNotDeclaredException ParameterType "
    "ParameterUninitializedException ParameterValue PublisherEventCallbacks "
    "QoSOverridingOptions ROSClock RcutilsLogger SetParametersResult SubscriptionEventCallbacks "
    "TimerInfo TopicEndpointInfo expand_topic_name get_logger "
    "qos_profile_parameter_events validate_full_topic_name validate_namespace "
    "validate_node_name validate_parameter_name validate_topic_name SrvType "
    "SrvTypeRequest SrvTypeResponse",
)


class Node(NodeParameters, NodeGraph):
    """A node of ROS 2.

    Args:
        node_name: The name, without a namespace.
        context: The context; None for the default one.
        cli_args: Arguments of this node alone.
        namespace: Where relative names belong.
        use_global_arguments: Take the context's arguments, too.
        enable_rosout: Publish the log on `/rosout`.
        rosout_qos_profile: The QoS of `/rosout`; a profile or a depth.
        start_parameter_services: Let other nodes read and set the parameters.
        parameter_overrides: Values for parameters.
        allow_undeclared_parameters: Reading and setting undeclared parameters is no error.
        automatically_declare_parameters_from_overrides: Declare every override.
        enable_logger_service: Let other nodes read and set the levels of the loggers.

    Raises:
        NotInitializedException: The context is not ok.
        NameValidationException: The name or the namespace breaks the rules.
        RCLInvalidROSArgsError, UnknownROSArgsError: `cli_args` cannot be read.
    """

    _callboard_classes: ClassVar[Mapping[type[Any], type[Any]]] = {}
    """The classes of entities that subclasses make instead of others."""

    def __init__(
        self,
        node_name: str,
        *,
        context: Context | None = None,
        cli_args: Sequence[str] | None = None,
        namespace: str | None = None,
        use_global_arguments: bool = True,
        enable_rosout: bool = True,
        rosout_qos_profile: QoSProfile | int = qos_profile_rosout_default,
        start_parameter_services: bool = True,
        parameter_overrides: Sequence[Parameter] | None = None,
        allow_undeclared_parameters: bool = False,
        automatically_declare_parameters_from_overrides: bool = False,
        enable_logger_service: bool = False,
    ) -> None:
        self._context = context or get_default_context()
        if not self._context.ok():
            raise NotInitializedException("cannot create node")
        self._default_callback_group: CallbackGroup = MutuallyExclusiveCallbackGroup()
        # Ticks of a rate must not wait for a callback that sleeps by it.
        self._rate_group = ReentrantCallbackGroup()
        self._callboard = NodeParts(
            self,
            self._context,
            self._default_callback_group,
            overrides=parameter_overrides or (),
            allow_undeclared=allow_undeclared_parameters,
            options={
                "node_name": node_name,
                "namespace": namespace,
                "cli_args": list(cli_args or ()),
                "use_global_arguments": use_global_arguments,
                "enable_rosout": enable_rosout,
                "rosout_qos_profile": profile_of(rosout_qos_profile).native(),
                "enable_logger_service": enable_logger_service,
            },
        )
        self._callboard.add(self._callboard.jumps)
        self._clock = self._callboard.clock
        self._logger = self._callboard.native.get_logger()
        store = self._callboard.store
        # Before anything is declared, so that declarations are published, too.
        publish_changes(self, store)
        if automatically_declare_parameters_from_overrides:
            store.declare_overrides()
        if start_parameter_services:
            serve_parameters(self, store, self._callboard.parameters_lock)
        if not self._context.track_node(self):  # another thread has shut it down meanwhile
            self.destroy_node()
            raise NotInitializedException("cannot create node")
        self._callboard.track()

    # Identity

    def get_name(self) -> str:
        """Return the name."""
        return self._callboard.native.get_name()

    def get_namespace(self) -> str:
        """Return the namespace."""
        return self._callboard.native.get_namespace()

    def get_fully_qualified_name(self) -> str:
        """Return namespace and name."""
        return self._callboard.native.get_fully_qualified_name()

    def get_clock(self) -> Clock:
        """Return the clock."""
        return self._clock

    def get_logger(self) -> Logger:
        """Return the logger."""
        return self._logger

    @property
    def handle(self) -> Handle:
        """In place of rclpy's handle."""
        return DESTROYED if self._callboard.destroyed else VALID

    @property
    def context(self) -> Context:
        """The context."""
        return self._context

    @property
    def default_callback_group(self) -> CallbackGroup:
        """The callback group of entities that are made without one."""
        return self._default_callback_group

    def resolve_topic_name(self, topic: str, *, only_expand: bool = False) -> str:
        """Return the full name of a topic.

        Raises:
            RCLError: It is no name.
        """
        try:
            return self._callboard.native.resolve_topic_name(topic, only_expand=only_expand)
        except InvalidNameError as error:
            raise RCLError(str(error)) from error

    def resolve_service_name(self, service: str, *, only_expand: bool = False) -> str:
        """Return the full name of a service.

        Raises:
            RCLError: It is no name.
        """
        try:
            return self._callboard.native.resolve_service_name(service, only_expand=only_expand)
        except InvalidNameError as error:
            raise RCLError(str(error)) from error

    # Entities

    @property
    def executor(self) -> Executor | None:
        """The executor that runs its callbacks, or did so last."""
        executor = self._callboard.executor
        return None if executor is None else cast("Executor | None", executor())  # the setter takes no other

    @executor.setter
    def executor(self, new_executor: Executor | None) -> None:
        current = self.executor
        if current is new_executor:
            return
        # Set before either executor is called: each of them sets this property as well, and then finds it
        # done.
        self._callboard.executor = None if new_executor is None else weakref.ref(new_executor)
        if current is not None:
            current.remove_node(self)
        if new_executor is not None:
            new_executor.add_node(self)

    @property
    def active_executor(self) -> EntityExecutor | None:
        """The executor that runs its callbacks now."""
        executor = self._callboard.active_executor
        return None if executor is None else executor()

    @property
    def publishers(self) -> Iterator[Publisher[Any]]:
        """Its publishers."""
        yield from self._callboard.publishers

    @property
    def subscriptions(self) -> Iterator[Subscription[Any]]:
        """Its subscriptions."""
        yield from self._callboard.of(Subscription)

    @property
    def clients(self) -> Iterator[Client[Any, Any, Any]]:
        """Its clients."""
        yield from self._callboard.of(Client)

    @property
    def services(self) -> Iterator[Service[Any, Any, Any]]:
        """Its services."""
        yield from self._callboard.of(Service)

    @property
    def timers(self) -> Iterator[Timer]:
        """Its timers."""
        yield from self._callboard.of(Timer)

    @property
    def guards(self) -> Iterator[GuardCondition]:
        """Its guard conditions."""
        yield from self._callboard.of(GuardCondition)

    @property
    def waitables(self) -> Iterator[Waitable[Any] | Entity]:
        """Its other entities, such as action servers."""
        kinds = (Subscription, Client, Service, Timer, GuardCondition)
        for each in self._callboard.all_entities():
            if isinstance(each, WaitableEntity):
                yield each.waitable
            elif not isinstance(each, kinds):
                yield each

    def add_waitable(self, waitable: Waitable[Any] | Entity) -> None:
        """Run the callbacks of another entity, such as an action server."""
        self._callboard.add(WaitableEntity(waitable) if isinstance(waitable, Waitable) else waitable)

    def remove_waitable(self, waitable: Waitable[Any] | Entity) -> None:
        """Stop running the callbacks of an entity that was added."""
        for each in self._callboard.all_entities():
            if each is waitable or (isinstance(each, WaitableEntity) and each.waitable is waitable):
                self._callboard.detach(each)

    def create_publisher(
        self,
        msg_type: type[MsgT],
        topic: str,
        qos_profile: QoSProfile | int = 10,
        *,
        callback_group: CallbackGroup | None = None,
        event_callbacks: PublisherEventCallbacks | None = None,
        qos_overriding_options: QoSOverridingOptions | None = None,
        publisher_class: type[Publisher[MsgT]] = Publisher,
    ) -> Publisher[MsgT]:
        """Make a publisher.

        Args:
            msg_type: The message class.
            topic: The topic's name.
            qos_profile: A profile or a depth.
            callback_group: When its event callbacks may run; None for the node's default group.
            event_callbacks: Callbacks for its QoS events.
            qos_overriding_options: Which policies parameters may override.
            publisher_class: The class to instantiate.

        Returns:
            The publisher.
        """
        _require_message(msg_type)
        profile = _overridden(self, profile_of(qos_profile), qos_overriding_options, topic, "publisher")
        callbacks, handlers = _queue_events(self, event_callbacks, callback_group)
        parts = self._callboard
        claim = self._context.topic_types.claim(parts.native.resolve_topic_name(topic), msg_type)
        # Made in the loop, since callboard's objects belong to one thread.
        native = parts.thread.call(
            lambda: parts.native.create_publisher(
                msg_type, topic, profile.native(), event_callbacks=callbacks
            )
        )
        publisher = publisher_class(self._context, parts.thread, native, profile, handlers)
        publisher.lifeline, publisher.type_claim = parts.lifeline, claim
        publisher.node_logger_name = self._logger.name
        parts.publishers.append(publisher)
        for each in handlers:
            parts.add(each)
        return publisher

    def create_subscription(
        self,
        msg_type: type[MsgT],
        topic: str,
        callback: Callable[..., Any],
        qos_profile: QoSProfile | int,
        *,
        callback_group: CallbackGroup | None = None,
        event_callbacks: SubscriptionEventCallbacks | None = None,
        qos_overriding_options: QoSOverridingOptions | None = None,
        raw: bool = False,
        content_filter_options: ContentFilterOptions | None = None,
    ) -> Subscription[MsgT]:
        """Make a subscription.

        Args:
            msg_type: The message class.
            topic: The topic's name.
            callback: `(msg)` or `(msg, info)`.
            qos_profile: A profile or a depth.
            callback_group: When the callback may run; None for the node's default group.
            event_callbacks: Callbacks for its QoS events.
            qos_overriding_options: Which policies parameters may override.
            raw: Give messages as bytes, in CDR.
            content_filter_options: Which messages to receive, by their content; None for all.

        Returns:
            The subscription.

        Raises:
            RCLError: The content filter is wrong.
        """
        _require_message(msg_type)
        content_filter = _content_filter(content_filter_options, msg_type)
        profile = _overridden(self, profile_of(qos_profile), qos_overriding_options, topic, "subscription")
        callbacks, handlers = _queue_events(self, event_callbacks, callback_group)
        claim = self._context.topic_types.claim(self._callboard.native.resolve_topic_name(topic), msg_type)

        def create() -> Any:
            native = self._callboard.native.create_subscription(
                msg_type, topic, qos_profile=profile.native(), event_callbacks=callbacks
            )
            if content_filter is not None:
                select(native, content_filter.passes)  # now: no message has arrived
            return native

        native = self._callboard.thread.call(create)
        subscription: Subscription[MsgT] = self._callboard.class_for(Subscription)(
            self._callboard.thread,
            native,
            callback,
            callback_group or self._default_callback_group,
            profile,
            handlers,
            raw=raw,
            content_filter=content_filter,
        )
        subscription.node_logger_name, subscription.type_claim = self._logger.name, claim
        for each in (subscription, *handlers):
            self._callboard.add(each)
        return subscription

    def create_client(
        self,
        srv_type: Any,
        srv_name: str,
        *,
        qos_profile: QoSProfile = qos_profile_services_default,
        callback_group: CallbackGroup | None = None,
    ) -> Client[Any, Any, Any]:
        """Make a client of a service."""
        native = self._callboard.thread.call(lambda: self._callboard.native.create_client(srv_type, srv_name))
        client: Client[Any, Any, Any] = self._callboard.class_for(Client)(
            self._context,
            srv_type,
            srv_name,
            native,
            callback_group or self._default_callback_group,
            qos_profile,
        )
        client.lifeline = self._callboard.lifeline
        client.node_logger_name = self._logger.name
        self._callboard.add(client)
        return client

    def create_service(
        self,
        srv_type: Any,
        srv_name: str,
        callback: Callable[[Any, Any], Any],
        *,
        qos_profile: QoSProfile = qos_profile_services_default,
        callback_group: CallbackGroup | None = None,
    ) -> Service[Any, Any, Any]:
        """Serve requests with `callback(request, response)`, which returns the response."""
        service: Service[Any, Any, Any] = self._callboard.class_for(Service)(
            self._callboard.thread,
            srv_type,
            srv_name,
            # Concurrent in callboard: the callback group decides here, and the mailbox would let only one
            # request through at a time.
            lambda handle: self._callboard.native.create_service(srv_type, srv_name, handle, concurrent=True),
            callback,
            callback_group or self._default_callback_group,
            qos_profile,
        )
        service.node_logger_name = self._logger.name
        self._callboard.add(service)
        return service

    def create_timer(
        self,
        timer_period_sec: float,
        callback: Callable[..., Any] | None,
        callback_group: CallbackGroup | None = None,
        clock: Clock | None = None,
        autostart: bool = True,
    ) -> Timer:
        """Call a function periodically.

        Args:
            timer_period_sec: The period in seconds.
            callback: `()`, or with one parameter that is annotated as TimerInfo.
            callback_group: When it may run; None for the node's default group.
            clock: The clock to follow; None for the node's.
            autostart: Whether to tick before `Timer.reset` is called.

        Returns:
            The timer.
        """
        period_ns = int(float(timer_period_sec) * 1e9)
        group = callback_group or self._default_callback_group
        timer = self._callboard.class_for(Timer)(
            callback, group, period_ns, clock or self._clock, autostart=autostart
        )
        self._callboard.add(timer)
        timer.rearm()
        return timer

    def create_guard_condition(
        self, callback: Callable[[], Any], callback_group: CallbackGroup | None = None
    ) -> GuardCondition:
        """Call a function whenever the guard condition was triggered."""
        guard = GuardCondition(
            callback, callback_group or self._default_callback_group, context=self._context
        )
        self._callboard.add(guard)
        return guard

    def create_rate(self, frequency: float, clock: Clock | None = None) -> Rate:
        """Make a rate, for loops in threads that do not spin.

        Args:
            frequency: Ticks a second.
            clock: The clock to follow; None for the node's.

        Returns:
            The rate.

        Raises:
            ValueError: The frequency is not positive.
        """
        if frequency <= 0:
            raise ValueError("frequency must be > 0")
        timer = self.create_timer(1.0 / frequency, None, self._rate_group, clock)
        return Rate(timer, context=self._context)

    # Destruction

    def destroy_publisher(self, publisher: Publisher[Any]) -> bool:
        """Take a publisher out of service; return False if it is not this node's."""
        return self._callboard.destroy(self._callboard.publishers, publisher)

    def destroy_subscription(self, subscription: Subscription[Any]) -> bool:
        """Take a subscription out of service; return False if it is not this node's."""
        return self._callboard.destroy(self._callboard.of(Subscription), subscription)

    def destroy_client(self, client: Client[Any, Any, Any]) -> bool:
        """Take a client out of service; return False if it is not this node's."""
        return self._callboard.destroy(self._callboard.of(Client), client)

    def destroy_service(self, service: Service[Any, Any, Any]) -> bool:
        """Take a service out of service; return False if it is not this node's."""
        return self._callboard.destroy(self._callboard.of(Service), service)

    def destroy_timer(self, timer: Timer) -> bool:
        """Stop a timer for good; return False if it is not this node's."""
        return self._callboard.destroy(self._callboard.of(Timer), timer)

    def destroy_guard_condition(self, guard: GuardCondition) -> bool:
        """Take a guard condition out of service; return False if it is not this node's."""
        return self._callboard.destroy(self._callboard.of(GuardCondition), guard)

    def destroy_rate(self, rate: Rate) -> bool:
        """Take a rate out of service; return False if it is not this node's."""
        rate.destroy()
        return self.destroy_timer(rate.timer)

    def destroy_node(self) -> None:
        """Take the node and everything it has out of service; send what it has published. Idempotent."""
        parts = self._callboard
        if parts.destroyed:
            return
        # First: `destroy_node` may be called in a callback while another thread shuts the context down.
        parts.destroyed = True
        self._context.untrack_node(self)
        executor = self.executor
        if executor is not None:
            # Before callboard's node is left, so that no further callback begins on entities that are about
            # to go.
            executor.remove_node(self)
        parts.leave()
        # Timers exist only here: leaving callboard's node does not end them.
        for each in self.timers:
            each.destroy()
        # The others ended with callboard's node.
        for ended in (*parts.publishers, *parts.all_entities()):
            Destroyable.destroy(ended)
        parts.publishers.clear()
        for entities in parts.entities.values():
            entities.clear()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        exc_type: type[BaseException] | None,
        exc_val: BaseException | None,
        exc_tb: TracebackType | None,
    ) -> None:
        self.destroy_node()


def _require_message(msg_type: object) -> None:
    if not is_message_type(msg_type):
        raise TypeError(f"{msg_type!r} is no message class: import one such as std_msgs.msg.String")


def _content_filter(options: ContentFilterOptions | None, msg_type: type[Message]) -> ContentFilter | None:
    if options is None:
        return None
    from actors.ros.rclpy.content_filter import ContentFilter  # noqa: PLC0415 - few programs filter

    return ContentFilter(options.filter_expression, options.expression_parameters, msg_type)


def _overridden(
    node: Node,
    profile: QoSProfile,
    options: QoSOverridingOptions | None,
    topic: str,
    kind: Literal["publisher", "subscription"],
) -> QoSProfile:
    """Return a profile with the policies that parameters override."""
    if options is None:
        return profile
    parts = parts_of(node)
    with parts.parameters_lock:
        return overridden(profile, options, parts.store, node.resolve_topic_name(topic), kind)


def _queue_events(
    node: Node,
    callbacks: PublisherEventCallbacks | SubscriptionEventCallbacks | None,
    group: CallbackGroup | None,
) -> tuple[Any, list[EventCalls]]:
    """Return callboard's callbacks for the same events, and the entities that queue the calls."""
    if callbacks is None:
        return None, []
    events = EventCalls(parts_of(node).thread, group or node.default_callback_group)
    return events.queued(callbacks), [events]
