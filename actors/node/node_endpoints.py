"""What nodes of every kind have: a name, and publishers, subscriptions, services, clients and actions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal, TypeVar, overload

from actors.endpoints.client.client import Client
from actors.endpoints.endpoint import Handle, endpoint_of
from actors.endpoints.publisher.publisher import Publisher
from actors.endpoints.service.service import ServiceServer
from actors.endpoints.subscription.subscription import Subscription
from actors.qos.profile import QoSProfile, qos_from, renamed_qos

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable

    from typing_extensions import Buffer

    from actors.actions.client import ActionClient
    from actors.actions.server import ActionServer
    from actors.arguments.remapping import Remapper
    from actors.endpoints.context import NodeContext
    from actors.endpoints.events import PublisherEventCallbacks, SubscriptionEventCallbacks
    from actors.endpoints.subscription.backlog import MessageInfo
    from actors.interfaces.message import ActionType, Message, ServiceType
    from actors.logging.logger import Logger
    from actors.node.qos_overrides import QoSOverridingOptions
    from actors.time.clock import Clock

MessageT = TypeVar("MessageT", bound="Message")
RequestT = TypeVar("RequestT", bound="Message")
ResponseT = TypeVar("ResponseT", bound="Message")
GoalT = TypeVar("GoalT", bound="Message")
ResultT = TypeVar("ResultT", bound="Message")
FeedbackT = TypeVar("FeedbackT", bound="Message")


class NodeEndpoints:
    """A node's name, and what makes and destroys its endpoints."""

    _context: NodeContext
    _names: Remapper

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
        qos = qos_from(qos_profile)
        return name, qos if options is None else self._overridden(qos, options, name, kind)

    def _overridden(
        self,
        qos: QoSProfile,
        options: QoSOverridingOptions,
        topic: str,
        kind: Literal["publisher", "subscription"],
    ) -> QoSProfile:
        """Return the QoS of an endpoint with the overrides of the node's parameters."""
        del qos, options, kind
        raise ValueError(f"'{topic}': a bare node has no parameters that could override its QoS")

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
            msg_type: A message class; with `raw=True` None for every type.
            topic: As for `create_publisher`.
            callback: `(msg)` or `(msg, info)`, `def` or `async def`. Without one, iterate or `take`.
            qos_profile: A profile or a depth.
            qos: The former name of `qos_profile`.
            concurrent: Do not wait for the node's other callbacks, nor for this one. At most 1,000 run at a
                time; further messages wait.
            raw: Give each message as bytes (msgpack), which nobody has decoded.
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


def _parts(srv_type: Any) -> tuple[type[Any], type[Any]]:
    try:
        return srv_type.Request, srv_type.Response
    except AttributeError:
        raise TypeError(
            f"{srv_type!r} is no service type: pass one such as AddTwoInts, or a subclass of actors.Service"
        ) from None
