"""Options of a node that rclpy's Node does not have."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal, TypedDict

from actors.callbacks.timing import SLOW_CALLBACK_SEC
from actors.endpoints.context import DEFAULT_CALL_TIMEOUT_SEC
from actors.node.node_runner import STOP_TIMEOUT_SEC
from actors.session.shared_memory import MIN_BYTES
from proto.checks import require_domain, require_seconds
from proto.wire.labels import check_labels

if TYPE_CHECKING:
    from collections.abc import Mapping

    from actors.arguments.ros_arguments import RosArguments


@dataclass(frozen=True, kw_only=True, slots=True)
class NodeOptions:
    """Options of a node that rclpy's Node does not have, for programs that make several nodes alike.

        options = NodeOptions(url="callboard://robot", stop_timeout_sec=1.0)
        camera, lidar = Node("camera", options=options), Node("lidar", options=options, strict_qos=True)

    `Node` takes each field as a keyword, too; a keyword wins over the field.

    Attributes:
        url: The broker, or several, separated by commas: whenever there is no link they are tried in this
            order, so that a node comes back to the first that answers, but leaves none that it is linked to.
            CALLBOARD_URL, the context in use (`actors.config.contexts`) and then callboard://127.0.0.1:7411
            are the defaults, in this order.
        domain: Which of a broker's disjoint graphs to join, 0 to 232. CALLBOARD_DOMAIN, the context's and
            then 0 are the defaults, in this order.
        token: What to present to a broker with access rules, in place of the environment's or the context's
            token. `repr` hides it.
        client_address: The IP address of the client on whose behalf the node works, if it is part of a server
            such as a page or a gateway. Roles with `from` then apply to the node only if they apply to that
            address, too. None (default): the node works for its own process.
        process_arguments: ROS arguments of the process, as parsed by `actors.parse_ros_arguments`; None: what
            `actors.run` found on the command line. Ignored with `use_global_arguments=False`.
        start_diagnostics_service: Tell other nodes where the node runs and what its callbacks take: the
            service `~/get_diagnostics`; default: True.
        connect_timeout_sec: Seconds after which entering raises BrokerUnreachable if no broker has accepted
            the node; None (default) enters without one, and goes on trying in the background.
        default_call_timeout_sec: The deadline, in seconds, of calls and waits that name none; default: 60.
        stop_timeout_sec: Seconds that leaving gives running callbacks to end, and then queued messages to be
            sent, an attempt to connect that is in progress included; default: 5. What could not be sent is
            counted in a warning. Callbacks that still run are cancelled; all in all leaving takes at most two
            seconds longer.
        slow_callback_sec: A callback that holds the event loop for more seconds is named in a warning;
            default: 0.1; None: never.
        shared_memory: Send and receive large messages in shared memory if the broker is on this host (Linux,
            same user); default: True. CALLBOARD_SHARED_MEMORY=0 turns it off for all nodes of a process.
        shared_memory_min_bytes: The size in bytes from which on a message is large: at least 4 KiB; default:
            16 KiB.
        shared_name: Let other nodes have the same full name if they share it, too, as ROS 2 does; default:
            False. Names of topics and services that begin with `~/` are the same then, and a call of a
            service that several nodes serve reaches one of them.
        strict_qos: The default of the node's publishers and subscriptions, ROS 2's endpoints included:
            whether they match none with which their QoS is incompatible; default: False. Otherwise messages
            are delivered all the same, unless the other endpoint is strict; both sides get a warning in any
            case.
        labels: Texts by name, which the graph shows beside the node's name, such as {"origin": "ros2/7"}.
            They are for users and tools, and have no other effect. At most 16; a name is 1 to 64 letters,
            digits and `_./-`, a value printable text of at most 256 bytes, all together at most 1 KiB.
        on_error: "log" (default): a callback that raises is logged and counted; "stop": the node ends with
            the error.

    Raises:
        ValueError: `domain` is not from 0 to 232, `client_address` is no IP address, a label is not allowed,
            or a time is negative or NaN.
        TypeError: `domain` is not an int, or a time not a number.
    """

    url: str | None = None
    domain: int | None = None
    token: str | None = field(default=None, repr=False)
    client_address: str | None = None
    process_arguments: RosArguments | None = None
    start_diagnostics_service: bool = True
    connect_timeout_sec: float | None = None
    default_call_timeout_sec: float = DEFAULT_CALL_TIMEOUT_SEC
    stop_timeout_sec: float = STOP_TIMEOUT_SEC
    slow_callback_sec: float | None = SLOW_CALLBACK_SEC
    shared_memory: bool = True
    shared_memory_min_bytes: int = MIN_BYTES
    shared_name: bool = False
    strict_qos: bool = False
    labels: Mapping[str, str] | None = None
    on_error: Literal["log", "stop"] = "log"

    def __post_init__(self) -> None:
        if self.domain is not None:
            require_domain(self.domain)
        if self.client_address is not None:
            _require_address(self.client_address)
        if self.connect_timeout_sec is not None:
            require_seconds("connect_timeout_sec", self.connect_timeout_sec)
        require_seconds("default_call_timeout_sec", self.default_call_timeout_sec)
        require_seconds("stop_timeout_sec", self.stop_timeout_sec)
        if self.labels:
            check_labels(self.labels)


def _require_address(address: str) -> None:
    from proto.wire.addresses import parse_client_address  # noqa: PLC0415 - few nodes have one

    try:
        parse_client_address(address)
    except ValueError:
        text = f"client_address must be an IP address, such as '192.0.2.7' or '2001:db8::7', not {address!r}"
        raise ValueError(text) from None


class NodeKeywords(TypedDict, total=False):
    """The fields of NodeOptions as keywords of `Node`, for type checkers, which cannot derive them.

    A test compares the two.
    """

    url: str | None
    domain: int | None
    token: str | None
    client_address: str | None
    process_arguments: RosArguments | None
    start_diagnostics_service: bool
    connect_timeout_sec: float | None
    default_call_timeout_sec: float
    stop_timeout_sec: float
    slow_callback_sec: float | None
    shared_memory: bool
    shared_memory_min_bytes: int
    shared_name: bool
    strict_qos: bool
    labels: Mapping[str, str] | None
    on_error: Literal["log", "stop"]
