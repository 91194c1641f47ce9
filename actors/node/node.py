"""The node: the composition root of publishers, subscriptions, services, clients, timers and parameters.

A node is made without a running loop; it connects on `async with node:` or `await node.run()`.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, Literal, Self, TypeVar, Unpack, overload

from actors.arguments.remapping import Remapper
from actors.arguments.ros_arguments import RosArguments, parse_ros_arguments
from actors.arguments.ros_arguments import process_arguments as found_arguments
from actors.config.contexts import find_broker_target, warn_of_ros_domain
from actors.config.environment import allows_shared_memory
from actors.endpoints.client.client import Client
from actors.endpoints.context import NodeContext
from actors.endpoints.endpoint import Handle, endpoint_of
from actors.endpoints.publisher.publisher import Publisher
from actors.endpoints.service.service import ServiceServer
from actors.endpoints.subscription.subscription import Subscription
from actors.endpoints.timer import Timer
from actors.graph.view import BrokerView
from actors.logging.logger import Logger, get_logger, node_logger_name
from actors.logging.sinks import DiscardingSink, add_sink
from actors.node.decorators import declared
from actors.node.graph_queries import NodeGraph
from actors.node.node_runner import NodeRunner
from actors.node.options import NodeKeywords, NodeOptions
from actors.node.parameters import NodeParameters
from actors.node.qos_overrides import overridden
from actors.node.time_source import TimeSource
from actors.parameters.store import ParameterStore
from actors.qos.profile import QoSProfile, qos_from, qos_profile_rosout_default, renamed_qos
from actors.session.connector import Connector
from actors.session.link import Link
from actors.session.shared_memory import SharedMemory
from actors.time.rate import Rate
from proto.wire.names import full_node_name, normalize_namespace, validate_namespace, validate_node_name

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable, Mapping
    from types import TracebackType

    from typing_extensions import Buffer

    from actors.actions.client import ActionClient
    from actors.actions.server import ActionServer
    from actors.diagnostics.records import NodeDiagnostics
    from actors.endpoints.events import PublisherEventCallbacks, SubscriptionEventCallbacks
    from actors.endpoints.subscription.backlog import MessageInfo
    from actors.interfaces.message import ActionType, Message, ServiceType
    from actors.node.qos_overrides import QoSOverridingOptions
    from actors.parameters.types import ParameterValue
    from actors.time.clock import Clock

MessageT = TypeVar("MessageT", bound="Message")
RequestT = TypeVar("RequestT", bound="Message")
ResponseT = TypeVar("ResponseT", bound="Message")
GoalT = TypeVar("GoalT", bound="Message")
ResultT = TypeVar("ResultT", bound="Message")
FeedbackT = TypeVar("FeedbackT", bound="Message")

_DEFAULT_OPTIONS = NodeOptions()


class Node(NodeGraph, NodeParameters):
    """A named actor: callbacks on topics, services and timers.

    Args:
        node_name: The name, without a namespace. A remap (`-r __node:=…`) goes before it.
        namespace: "" or None is the root; "ns" means "/ns".
        cli_args: Arguments of this node alone: ["--ros-args", "-r", "a:=b"]. They win over the process's.
        use_global_arguments: Take what `actors.run` found on the command line.
        parameter_overrides: Values for parameters; they win over the command line and files.
        allow_undeclared_parameters: Reading and setting undeclared parameters is no error.
        automatically_declare_parameters_from_overrides: Declare every override.
        start_parameter_services: Let other nodes read, set and watch the parameters: ROS 2's services below
            the node's name, and the topic `/parameter_events`.
        enable_rosout: Publish the log of the node's logger and its children on `/rosout`, too. The ROS
            argument `--disable-rosout-logs` turns it off for all nodes of a process.
        rosout_qos_profile: The QoS of `/rosout`; a profile or a depth.
        enable_logger_service: Let other nodes read and set the levels of this process's loggers: the services
            `~/get_logger_levels` and `~/set_logger_levels`.
        options: What callboard adds to rclpy's Node: the broker, time limits, shared memory and so on.
        keywords: Fields of NodeOptions; they win over `options`.

    Raises:
        InvalidNameError: The name or namespace breaks the naming rules.
        InvalidRosArgumentError: `cli_args` cannot be read.
        InvalidUrlError: The broker URL cannot be read.
        InvalidEnvironmentError: CALLBOARD_DOMAIN is not an integer from 0 to 232, or CALLBOARD_SHARED_MEMORY
            is neither 1 nor 0.
        ContextError: CALLBOARD_CONTEXT names no context, or the file of contexts is broken.
        InvalidParameterTypeError: An override has another type than the parameter.
        RuntimeError: A decorated method takes a wrong number of arguments.
        ValueError: `domain` is not from 0 to 232, or a time is negative or NaN.
        TypeError: `domain` is not an int, or a time not a number, or a keyword is unknown.
    """

    def __init__(
        self,
        node_name: str,
        *,
        namespace: str | None = None,
        cli_args: list[str] | None = None,
        use_global_arguments: bool = True,
        parameter_overrides: Mapping[str, ParameterValue] | None = None,
        allow_undeclared_parameters: bool = False,
        automatically_declare_parameters_from_overrides: bool = False,
        start_parameter_services: bool = True,
        enable_rosout: bool = True,
        rosout_qos_profile: QoSProfile | int = qos_profile_rosout_default,
        enable_logger_service: bool = False,
        options: NodeOptions = _DEFAULT_OPTIONS,
        **keywords: Unpack[NodeKeywords],
    ) -> None:
        if keywords:
            options = replace(options, **keywords)
        own = parse_ros_arguments(cli_args or [])
        shared = (options.process_arguments or found_arguments.get()) if use_global_arguments else None
        shared = shared or RosArguments()
        absolute = normalize_namespace(namespace or "")
        validate_node_name(node_name)
        validate_namespace(absolute)
        self._names = Remapper(node_name, absolute, rules=own.remap_rules, process_rules=shared.remap_rules)
        full_name = full_node_name(self._names.namespace, self._names.name)
        log = get_logger(node_logger_name(full_name))
        target = find_broker_target(options.url or None, options.domain)
        warn_of_ros_domain(target, log.warning)
        credentials = target.credentials
        if options.token is not None:
            credentials = credentials.with_token(options.token)
        shares = allows_shared_memory() and options.shared_memory
        memory = SharedMemory(enabled=shares, min_bytes=options.shared_memory_min_bytes, warn=log.warning)
        link = Link(", ".join(map(str, target.urls)), memory)
        self._context = NodeContext(
            name=self._names.name,
            namespace=self._names.namespace,
            log=log,
            link=link,
            default_call_timeout_sec=options.default_call_timeout_sec,
            stop_on_error=options.on_error == "stop",
            slow_callback_sec=options.slow_callback_sec,
            shared_name=options.shared_name,
            strict_qos=options.strict_qos,
        )
        self._broker = BrokerView(self._context)
        self._argument_overrides = {**shared.parameters_for(full_name), **own.parameters_for(full_name)}
        self._parameters = ParameterStore(
            overrides=parameter_overrides,
            argument_overrides=self._argument_overrides,
            allow_undeclared=allow_undeclared_parameters,
        )
        if enable_rosout and own.rosout_logs and shared.rosout_logs:
            from actors.node.rosout import Rosout  # noqa: PLC0415 - hidden nodes do without

            Rosout(self._context, self._names, domain=target.domain, qos=rosout_qos_profile)
        else:  # a node whose name is the start of this one's must not publish its lines
            self._no_rosout = DiscardingSink()
            add_sink(log.name, self._no_rosout)
        if start_parameter_services:
            from actors.node.parameter_services import ParameterServices  # noqa: PLC0415 - hidden nodes do without

            ParameterServices(self._context, self._names, self._parameters)
        if enable_logger_service:
            from actors.node.logger_services import LoggerServices  # noqa: PLC0415 - few nodes have them

            LoggerServices(self._context, self._names)
        if self._parameters.get("start_type_description_service").value:
            from actors.node.type_description import TypeDescriptionService  # noqa: PLC0415 - hidden nodes do without

            TypeDescriptionService(self._context, self._names)
        if options.start_diagnostics_service:
            from actors.node.diagnostics_service import DiagnosticsService  # noqa: PLC0415 - hidden nodes do without

            DiagnosticsService(self._context, self._names, self.diagnostics)
        TimeSource(self._context, self._names, self._parameters)
        if automatically_declare_parameters_from_overrides:
            self._parameters.declare_overrides()
        self._node_runner = NodeRunner(
            self._context,
            Connector(
                link,
                target.urls,
                domain=target.domain,
                client_address=options.client_address,
                credentials=credentials,
                log=log,
            ),
            connect_timeout_sec=options.connect_timeout_sec,
            stop_timeout_sec=options.stop_timeout_sec,
        )
        for method, declare in declared(type(self), Node):
            declare(self, getattr(self, method))

    if not TYPE_CHECKING:  # for type checkers a node would have every attribute

        def __getattr__(self, name: str) -> object:
            if "_node_runner" in self.__dict__:
                # Python's own error; or that of a property, which Python has replaced by this call.
                return object.__getattribute__(self, name)
            cls = type(self).__name__
            raise AttributeError(
                f"'{cls}' object has no attribute '{name}': {cls}.__init__ has to call"
                " super().__init__(node_name) before it uses the node",
                name=name,
                obj=self,
            )

    # Identity and state

    def get_name(self) -> str:
        """Return the node's name, without the namespace.

        Returns:
            The name after remapping.
        """
        return self._context.name

    def get_namespace(self) -> str:
        """Return the node's namespace, such as "/" or "/ns".

        Returns:
            The namespace after remapping.
        """
        return self._context.namespace

    def get_fully_qualified_name(self) -> str:
        """Return namespace and name, such as "/ns/talker".

        Returns:
            The full name after remapping.
        """
        return self._context.full_name

    def get_logger(self) -> Logger:
        """Return the node's logger.

        Returns:
            The logger named after the node's full name.
        """
        return self._context.log

    def get_clock(self) -> Clock:
        """Return the node's clock.

        Returns:
            The clock, of ROS_TIME: `.now()` is the time, simulated while the parameter `use_sim_time` is set.
        """
        return self._context.clock

    @property
    def argument_overrides(self) -> Mapping[str, ParameterValue]:
        """The values for parameters that the command line and its files have for this node, by name."""
        return self._argument_overrides

    @property
    def callback_errors(self) -> int:
        """Callbacks that have raised so far."""
        return self._context.callback_errors

    @property
    def connected(self) -> bool:
        """Whether there is a session with a broker now."""
        return self._context.link.connected

    @property
    def user(self) -> str | None:
        """Who this node is to the broker's access rules; None before the first session, and without rules."""
        return self._context.link.user

    def diagnostics(self) -> NodeDiagnostics:
        """Return what the node holds, drops and spends its time on. Works at any time, and is cheap.

        Returns:
            The state and counts of now. Two give rates: `later.rates_since(earlier)`.
        """
        from actors.node.diagnostics import diagnose  # noqa: PLC0415 - seldom needed

        return diagnose(self._context, self._node_runner)

    def resolve_topic_name(self, topic: str, *, only_expand: bool = False) -> str:
        """Return the full name of a topic.

        Args:
            topic: Relative to the namespace, absolute with `/`, private with `~/`.
            only_expand: Do not apply remap rules.

        Returns:
            The full name, such as "/ns/chatter".

        Raises:
            InvalidTopicNameError: The name breaks the rules.
        """
        return self._names.resolve_topic(topic, only_expand=only_expand)

    def resolve_service_name(self, service: str, *, only_expand: bool = False) -> str:
        """Return the full name of a service.

        Args:
            service: Relative to the namespace, absolute with `/`, private with `~/`.
            only_expand: Do not apply remap rules.

        Returns:
            The full name, such as "/ns/add".

        Raises:
            InvalidServiceNameError: The name breaks the rules.
        """
        return self._names.resolve_service(service, only_expand=only_expand)

    # Endpoints and timers

    def create_publisher(
        self,
        msg_type: type[MessageT],
        topic: str,
        qos_profile: QoSProfile | int = 10,
        *,
        event_callbacks: PublisherEventCallbacks | None = None,
        qos_overriding_options: QoSOverridingOptions | None = None,
        strict_qos: bool | None = None,
    ) -> Publisher[MessageT]:
        """Make a publisher.

        Args:
            msg_type: A message class: generated, or a subclass of `actors.Message`.
            topic: Relative to the namespace, absolute with `/`, private with `~/`.
            qos_profile: A profile, or a depth, which means KEEP_LAST of that depth.
            event_callbacks: Callbacks for its QoS events.
            qos_overriding_options: Which policies may be overridden by parameters such as
                `qos_overrides./chatter.publisher.depth`; None for none.
            strict_qos: Match no subscription with which the QoS is incompatible, as in ROS 2: nothing is
                delivered between the two. None is the node's default.

        Returns:
            The publisher.

        Raises:
            InvalidTopicNameError: The name breaks the rules.
            InvalidParameterTypeError, InvalidParameterValueError: An override is no such policy.
            InvalidQoSProfileError: The callback of the options refuses the overrides.
            TypeError, ValueError: No message class, or no QoS.
            NodeDestroyed: The node has been destroyed.
        """
        name, qos = self._topic_and_qos(topic, qos_profile, qos_overriding_options, "publisher")
        return Publisher(self._context, msg_type, name, qos, event_callbacks, strict_qos=strict_qos)

    def _topic_and_qos(
        self,
        topic: str,
        qos_profile: QoSProfile | int,
        options: QoSOverridingOptions | None,
        kind: Literal["publisher", "subscription"],
    ) -> tuple[str, QoSProfile]:
        """Return the full name of an endpoint's topic, and its QoS with the overrides."""
        name = self._names.resolve_topic(topic)
        return name, overridden(qos_from(qos_profile), options, self._parameters, name, kind)

    @overload
    def create_subscription(
        self,
        msg_type: type[MessageT],
        topic: str,
        callback: Callable[[MessageT], object] | Callable[[MessageT, MessageInfo], object] | None = ...,
        qos_profile: QoSProfile | int = ...,
        *,
        concurrent: bool = ...,
        raw: Literal[False] = ...,
        event_callbacks: SubscriptionEventCallbacks | None = ...,
        qos_overriding_options: QoSOverridingOptions | None = ...,
        stall_timeout_sec: float = ...,
        strict_qos: bool | None = ...,
    ) -> Subscription[MessageT]: ...

    @overload
    def create_subscription(
        self,
        msg_type: type[Message] | None,
        topic: str,
        callback: Callable[..., Any] | None = ...,
        qos_profile: QoSProfile | int = ...,
        *,
        concurrent: bool = ...,
        raw: bool,
        event_callbacks: SubscriptionEventCallbacks | None = ...,
        qos_overriding_options: QoSOverridingOptions | None = ...,
        stall_timeout_sec: float = ...,
        strict_qos: bool | None = ...,
    ) -> Subscription[Any]: ...

    def create_subscription(
        self,
        msg_type: type[Message] | None,
        topic: str,
        callback: Callable[..., Any] | None = None,
        qos_profile: QoSProfile | int = 10,
        *,
        qos: QoSProfile | int | None = None,
        concurrent: bool = False,
        raw: bool = False,
        event_callbacks: SubscriptionEventCallbacks | None = None,
        qos_overriding_options: QoSOverridingOptions | None = None,
        stall_timeout_sec: float = 0.0,
        strict_qos: bool | None = None,
    ) -> Subscription[Any]:
        """Make a subscription.

        Args:
            msg_type: A message class; may be None with `raw=True`.
            topic: As for `create_publisher`.
            callback: `(msg)` or `(msg, info)`, `def` or `async def`. Without one, iterate or `take`.
            qos_profile: A profile or a depth.
            qos: The former name of `qos_profile`.
            concurrent: Do not wait for the node's other callbacks, nor for this one. At most 1,000 run at a
                time; further messages wait.
            raw: Give each message as bytes (msgpack), and match publishers of every type.
            event_callbacks: Callbacks for its QoS events.
            qos_overriding_options: As for `create_publisher`.
            stall_timeout_sec: Seconds that KEEP_ALL publishers wait while this KEEP_ALL subscription takes no
                message, if that is longer than the broker's limit (60); at most the broker's maximum (600).
            strict_qos: Match no publisher with which the QoS is incompatible, as for `create_publisher`.

        Returns:
            The subscription.

        Raises:
            InvalidTopicNameError: The name breaks the rules.
            InvalidParameterTypeError, InvalidParameterValueError: An override is no such policy.
            InvalidQoSProfileError: The callback of the options refuses the overrides.
            RuntimeError: The callback takes neither one nor two arguments.
            TypeError, ValueError: No message class, or no QoS.
            NodeDestroyed: The node has been destroyed.
        """
        if msg_type is None and not raw:
            raise TypeError("create_subscription needs a message class, unless raw=True")
        if qos is not None:
            qos_profile = renamed_qos(qos)
        name, profile = self._topic_and_qos(topic, qos_profile, qos_overriding_options, "subscription")
        return Subscription(
            self._context,
            msg_type,
            name,
            callback,
            profile,
            concurrent=concurrent,
            raw=raw,
            event_callbacks=event_callbacks,
            stall_timeout_sec=stall_timeout_sec,
            strict_qos=strict_qos,
        )

    @overload
    def create_service(
        self,
        srv_type: type[ServiceType[RequestT, ResponseT]],
        srv_name: str,
        callback: Callable[[RequestT], ResponseT | Awaitable[ResponseT]]
        | Callable[[RequestT, ResponseT], ResponseT | Awaitable[ResponseT]],
        *,
        concurrent: bool = ...,
        raw: Literal[False] = ...,
    ) -> ServiceServer[RequestT, ResponseT]: ...

    @overload
    def create_service(
        self,
        srv_type: type[ServiceType[Message, Message]],
        srv_name: str,
        callback: Callable[[bytes], Buffer | Awaitable[Buffer]],
        *,
        concurrent: bool = ...,
        raw: Literal[True],
    ) -> ServiceServer[bytes, bytes]: ...

    def create_service(
        self,
        srv_type: type[ServiceType[Message, Message]],
        srv_name: str,
        callback: Callable[..., Any],
        *,
        concurrent: bool = False,
        raw: bool = False,
    ) -> ServiceServer[Any, Any]:
        """Serve requests.

        Args:
            srv_type: A service class: generated, or a subclass of `actors.Service`.
            srv_name: As a topic's name.
            callback: `(request, response)` or `(request)`, returns the response; `def` or `async def`.
            concurrent: Handle requests concurrently with each other and with the node's other callbacks; at
                most 1,000 at a time.
            raw: Give each request as bytes (msgpack), not decoded, and take the response as bytes: the
                callback is `(request)`. The type is still declared and compared.

        Returns:
            The service.

        Raises:
            InvalidServiceNameError: The name breaks the rules.
            TypeError: `srv_type` is no service class.
            RuntimeError: The callback takes neither one nor two arguments, or not one and `raw` is set.
            NodeDestroyed: The node has been destroyed.
        """
        request, response = _parts(srv_type)
        name = self._names.resolve_service(srv_name)
        return ServiceServer(
            self._context,
            srv_type,
            request,
            response,
            name,
            callback=callback,
            concurrent=concurrent,
            raw=raw,
        )

    @overload
    def create_client(
        self,
        srv_type: type[ServiceType[RequestT, ResponseT]],
        srv_name: str,
        *,
        raw: Literal[False] = ...,
    ) -> Client[RequestT, ResponseT]: ...

    @overload
    def create_client(
        self, srv_type: type[ServiceType[Message, Message]], srv_name: str, *, raw: Literal[True]
    ) -> Client[bytes, bytes]: ...

    def create_client(
        self, srv_type: type[ServiceType[Message, Message]], srv_name: str, *, raw: bool = False
    ) -> Client[Any, Any]:
        """Make a client of a service.

        Args:
            srv_type: A service class: generated, or a subclass of `actors.Service`.
            srv_name: Relative to the namespace, absolute with `/`, private with `~/`.
            raw: Calls take requests as bytes (msgpack), and give responses as bytes that are not decoded. The
                type is still declared and compared.

        Returns:
            The client.

        Raises:
            InvalidServiceNameError: The name breaks the rules.
            TypeError: `srv_type` is no service class.
            NodeDestroyed: The node has been destroyed.
        """
        request, response = _parts(srv_type)
        name = self._names.resolve_service(srv_name)
        return Client(self._context, srv_type, request, response, name, raw=raw)

    def create_action_server(
        self,
        action_type: type[ActionType[GoalT, ResultT, FeedbackT]],
        action_name: str,
        execute_callback: Callable[..., Any],
        *,
        goal_callback: Callable[..., Any] | None = None,
        cancel_callback: Callable[..., Any] | None = None,
        handle_accepted_callback: Callable[..., Any] | None = None,
        result_timeout_sec: float = 10.0,
        cancel_execution: bool = False,
    ) -> ActionServer[GoalT, ResultT, FeedbackT]:
        """Execute goals. Each callback takes one argument and may be `def` or `async def`.

        Goals run concurrently with each other and with the node's other callbacks. At most 1,000 goals may be
        unfinished; further ones are rejected.

        Args:
            action_type: An action class: generated, or a subclass of `actors.Action`.
            action_name: As a topic's name; remap rules for topics apply to it.
            execute_callback: Gets a `ServerGoalHandle`, sets a terminal state and returns the result. A goal
                whose callback raises or sets no terminal state is aborted.
            goal_callback: Gets the goal message and returns a `GoalResponse`. Default: accept.
            cancel_callback: Gets the goal and returns a `CancelResponse`. Default: reject.
            handle_accepted_callback: Gets each accepted goal, and calls `goal.execute()` now or later.
                Default: now.
            result_timeout_sec: Seconds to keep results for clients that ask late; negative for no limit. Of
                more than 1,000 results, or 16 MiB, the oldest are dropped.
            cancel_execution: Cancel the execute callback when the goal's cancellation is accepted. If it ends
                with CancelledError, the goal is CANCELED.

        Returns:
            The server.

        Raises:
            InvalidTopicNameError: The name breaks the rules.
            TypeError: `action_type` is no action class.
            ValueError: `result_timeout_sec` is not a number.
            RuntimeError: A callback does not take one argument.
            NodeDestroyed: The node has been destroyed.
        """
        from actors.actions.server import ActionServer  # noqa: PLC0415 - takes time, and few nodes need it

        return ActionServer(
            self._context,
            action_type,
            self._names.resolve_topic(action_name),
            execute_callback,
            goal_callback=goal_callback,
            cancel_callback=cancel_callback,
            handle_accepted_callback=handle_accepted_callback,
            result_timeout_sec=result_timeout_sec,
            cancel_execution=cancel_execution,
        )

    def create_action_client(
        self, action_type: type[ActionType[GoalT, ResultT, FeedbackT]], action_name: str
    ) -> ActionClient[GoalT, ResultT, FeedbackT]:
        """Make a client of an action.

        Args:
            action_type: An action class: generated, or a subclass of `actors.Action`.
            action_name: As a topic's name; remap rules for topics apply to it.

        Returns:
            The client.

        Raises:
            InvalidTopicNameError: The name breaks the rules.
            TypeError: `action_type` is no action class.
            NodeDestroyed: The node has been destroyed.
        """
        from actors.actions.client import ActionClient  # noqa: PLC0415 - takes time, and few nodes need it

        return ActionClient(self._context, action_type, self._names.resolve_topic(action_name))

    def create_timer(
        self,
        timer_period_sec: float,
        callback: Callable[..., Any],
        *,
        clock: Clock | None = None,
        autostart: bool = True,
    ) -> Timer:
        """Call a function periodically, without drift.

        While the clock shows simulated time the period is measured in it.

        Args:
            timer_period_sec: The period in seconds, from 0 (as often as possible).
            callback: `()` or `(TimerInfo)`, `def` or `async def`.
            clock: The clock to follow; None is the node's. `Clock(ClockType.STEADY_TIME)` is never simulated.
            autostart: Whether to tick before `Timer.reset` is called.

        Returns:
            The timer.

        Raises:
            TypeError: The arguments are in the wrong order.
            ValueError: The period is negative or infinite.
            RuntimeError: The callback takes more than one argument.
            NodeDestroyed: The node has been destroyed.
        """
        return Timer(self._context, timer_period_sec, callback, clock=clock, autostart=autostart)

    def create_rate(self, frequency: float, clock: Clock | None = None) -> Rate:
        """Make a rate, for loops: `await rate.sleep()` sleeps until the next tick.

        Args:
            frequency: Ticks a second.
            clock: The clock to follow; None is the node's.

        Returns:
            The rate.

        Raises:
            TypeError: The frequency is not a number.
            ValueError: It is zero, negative or not finite.
            NodeDestroyed: The node has been destroyed.
        """
        self._context.require_alive()
        return Rate(frequency, clock or self._context.clock)

    def destroy_publisher(self, publisher: Publisher[Any]) -> bool:
        """Take a publisher out of service, after everything it has published has been sent.

        Args:
            publisher: The publisher.

        Returns:
            False if it is not this node's, or destroyed already.
        """
        return self._destroy(publisher)

    def destroy_subscription(self, subscription: Subscription[Any]) -> bool:
        """Take a subscription out of service.

        Args:
            subscription: The subscription.

        Returns:
            False if it is not this node's, or destroyed already.
        """
        return self._destroy(subscription)

    def destroy_service(self, service: ServiceServer[Any, Any]) -> bool:
        """Take a service out of service; its handlers are cancelled.

        Args:
            service: The service.

        Returns:
            False if it is not this node's, or destroyed already.
        """
        return self._destroy(service)

    def destroy_client(self, client: Client[Any, Any]) -> bool:
        """Take a client out of service; its pending calls are cancelled.

        Args:
            client: The client.

        Returns:
            False if it is not this node's, or destroyed already.
        """
        return self._destroy(client)

    def _destroy(self, handle: Handle[Any]) -> bool:
        mine = endpoint_of(handle) in self._context.endpoints
        if mine:
            handle.destroy()
        return mine

    def destroy_timer(self, timer: Timer) -> bool:
        """Stop a timer for good.

        Args:
            timer: The timer.

        Returns:
            False if it is not this node's, or destroyed already.
        """
        mine = any(source.id == timer.id for source in self._context.timers)
        if mine:
            timer.destroy()
        return mine

    def destroy_rate(self, rate: Rate) -> bool:
        """Take a rate out of service; its sleepers wake.

        Args:
            rate: The rate.

        Returns:
            True.
        """
        rate.destroy()
        return True

    # Start and stop

    async def __aenter__(self) -> Self:
        """Start: connect, and run callbacks as messages arrive.

        Returns when the node is in the graph: the first statement may publish, call and query. Without a
        broker it returns when all have refused, or after one second without an answer, and goes on trying in
        the background.

        Raises:
            BrokerUnreachable: No broker has accepted the node within `connect_timeout_sec`.
            NodeNameTaken: Another live node has this full name, and not both share it.
            NodeAlreadyRunningError: It runs already.
            NodeDestroyed: It has been destroyed.
        """
        await self._node_runner.begin()
        return self

    async def __aexit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> Literal[False]:
        """Stop: let running callbacks end, send what is queued, take everything out of service.

        No further callbacks are called; requests are answered with an error at once. If the task is cancelled
        meanwhile, callbacks are cancelled without waiting.
        """
        await self._node_runner.end(error)
        return False

    async def run(self) -> None:
        """Run until `destroy_node` is called, or the task is cancelled.

        Raises:
            NodeAlreadyRunningError: It runs already.
            BrokerUnreachable: No broker has accepted the node within `connect_timeout_sec`.
            NodeNameTaken: Another live node has this full name, and not both share it.
            NodeDestroyed: It has been destroyed before.
        """
        async with self:
            await self._node_runner.destroyed()

    def destroy_node(self) -> None:
        """Take the node and everything it has out of service at once; `run` returns. Idempotent.

        Callbacks that run are cancelled; callers of its services get ServiceUnavailable.
        """
        self._node_runner.destroy()


def _parts(srv_type: Any) -> tuple[type[Any], type[Any]]:
    try:
        return srv_type.Request, srv_type.Response
    except AttributeError:
        raise TypeError(
            f"{srv_type!r} is no service type: pass one such as AddTwoInts, or a subclass of actors.Service"
        ) from None
