"""The node: the composition root of publishers, subscriptions, services, clients, timers and parameters.

A node is made without a running loop; it connects on `async with node:` or `await node.run()`.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, Literal, Self, Unpack

from actors.arguments.remapping import Remapper
from actors.arguments.ros_arguments import RosArguments, parse_ros_arguments
from actors.arguments.ros_arguments import process_arguments as found_arguments
from actors.config.contexts import find_broker_target, warn_of_ros_domain
from actors.config.environment import allows_shared_memory
from actors.endpoints.context import NodeContext
from actors.endpoints.timer import Timer
from actors.graph.view import BrokerView
from actors.logging.logger import get_logger, node_logger_name
from actors.logging.sinks import DiscardingSink, add_sink
from actors.node.decorators import declared
from actors.node.graph_queries import NodeGraph
from actors.node.node_endpoints import NodeEndpoints
from actors.node.node_runner import NodeRunner
from actors.node.options import NodeKeywords, NodeOptions
from actors.node.parameters import NodeParameters
from actors.node.qos_overrides import overridden
from actors.node.time_source import TimeSource
from actors.parameters.store import ParameterStore
from actors.qos.profile import QoSProfile, qos_profile_rosout_default
from actors.session.connector import Connector
from actors.session.link import Link
from actors.session.shared_memory import SharedMemory
from actors.time.rate import Rate
from proto.wire.names import full_node_name, normalize_namespace, validate_namespace, validate_node_name

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from types import TracebackType

    from actors.diagnostics.records import NodeDiagnostics
    from actors.node.bare_node import BareNode
    from actors.node.qos_overrides import QoSOverridingOptions
    from actors.parameters.types import ParameterValue
    from actors.time.clock import Clock

_DEFAULT_OPTIONS = NodeOptions()


class Node(NodeEndpoints, NodeGraph, NodeParameters):
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
            labels=options.labels or {},
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

    # State

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

    def _overridden(
        self,
        qos: QoSProfile,
        options: QoSOverridingOptions,
        topic: str,
        kind: Literal["publisher", "subscription"],
    ) -> QoSProfile:
        return overridden(qos, options, self._parameters, topic, kind)

    # Timers and bare nodes

    def create_bare_node(
        self,
        node_name: str,
        *,
        namespace: str | None = None,
        labels: Mapping[str, str] | None = None,
        apart: str = "",
        shared_name: bool = False,
        yields_name: bool = False,
        on_refused: Callable[[str], object] | None = None,
    ) -> BareNode:
        """Make a node without a process of its own: a name in the graph, with endpoints, on this node's link.

        It has no standard endpoints (parameters, `/rosout`, `/clock`, type descriptions, diagnostics), so
        that hundreds of them are cheap. Its callbacks are this node's: they run one at a time with those of
        this node, unless an endpoint is `concurrent`, and what they raise is logged and counted here. Every
        session declares it again; it ends with this node.

        Args:
            node_name: The name, without a namespace. No remap rule applies to it, nor to the names of its
                endpoints, which are full, or relative to this name.
            namespace: "" or None is the root; "ns" means "/ns".
            labels: As `NodeOptions.labels`.
            apart: If it is not empty, no endpoint of this bare node matches one of a node with the same
                text, or another one of its own: for nodes that stand for those of another network, whose
                messages must not come back to it. Printable text of at most 256 bytes. A broker that does not
                know it refuses the bare node.
            shared_name: As `NodeOptions.shared_name`.
            yields_name: Whether a node that comes later and does not share its name takes this one's: the
                broker refuses this one then, and `on_refused` may make another one. By an older broker the
                newcomer is refused.
            on_refused: Called with the reason whenever a broker refuses it: `def` or `async def`. The link
                and all other nodes go on.

        Returns:
            The bare node. `await bare.wait_until_accepted()` tells whether the broker has accepted it.

        Raises:
            InvalidNameError: The name or namespace breaks the naming rules.
            ValueError: A label, or `apart`, is not allowed.
            RuntimeError: `on_refused` does not take one argument.
            NodeDestroyed: This node has been destroyed.
        """
        from actors.node.bare_node import BareNode  # noqa: PLC0415 - few programs have any

        return BareNode(
            self._context,
            node_name,
            normalize_namespace(namespace or ""),
            labels=labels or {},
            apart=apart,
            shared_name=shared_name,
            yields_name=yields_name,
            on_refused=on_refused,
        )

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
