"""What the parts of a node share: names, link, mailbox, logger, and the handling of callback errors."""

from __future__ import annotations

import asyncio
import math
from typing import TYPE_CHECKING, Any, Final, Protocol

from actors.callbacks.callback_task import current_callback_task
from actors.callbacks.functions import ENDS_PROGRAM
from actors.callbacks.mailbox import Mailbox
from actors.callbacks.timing import SLOW_CALLBACK_SEC, Stopwatch
from actors.endpoints.departing import DepartingQueues
from actors.errors import NodeDestroyed, WaitTimeout, error_text
from actors.interfaces.keyword_hint import add_keyword_hint
from actors.logging.limited_lines import LimitedLines
from actors.session.endpoint import LinkEndpoint
from actors.time.clock import Clock
from actors.time.jumps import ClockChange
from actors.time.ros_time import RosTime
from actors.time.timeout import DefaultTimeout
from actors.time.types import NANOSECONDS_PER_SECOND, ClockType
from proto.wire import frames
from proto.wire.codes import Capability, NoticeKind
from proto.wire.names import full_node_name

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from actors.diagnostics.records import TimerDiagnostics
    from actors.logging.logger import Logger
    from actors.qos.profile import QoSProfile
    from actors.session.link import Link
    from actors.time.timeout import Timeout

DEFAULT_CALL_TIMEOUT_SEC: Final = 60.0


class NodeEndpoint(Protocol):
    """What a node calls on its endpoints, which import this module: publishers, services and so on.

    Attributes:
        id: Its number on the link.
    """

    id: int

    @property
    def interface(self) -> type[Any] | None:
        """Its message or service class; None for one of every type."""
        ...

    def time_shifted(self, seconds: float) -> None:
        """Correct points in time of `NodeContext.time`, which has jumped."""
        ...

    def retire(self) -> None:
        """Begin nothing new, as the node stops."""
        ...

    def destroy(self) -> None:
        """Take it out of service."""
        ...


class NodeTimer(Protocol):
    """What a node calls on its timers.

    Attributes:
        id: Its number in this process.
    """

    id: int

    def start(self) -> None:
        """Begin to tick, as the node runs now."""
        ...

    def cancel(self) -> None:
        """Stop ticking, as the node stops."""
        ...

    def destroy(self) -> None:
        """Stop for good."""
        ...

    def diagnostics(self) -> TimerDiagnostics:
        """Return its state and counts."""
        ...


class NodeContext(LinkEndpoint):
    """What the parts of a node share. It is also the node's own endpoint on the link.

    Attributes:
        ros_time: The simulated time of the node's clock; set from `/clock`.
        clock: The node's clock, which is destroyed with it.
        callback_errors: Callbacks that have raised so far.
        watch: Measures the node's callbacks.
        stopping: Whether the node is stopping and begins nothing new.
        unread: Messages received but not taken by callbacks when the node stopped.
        shared_name: Whether other nodes may have the same name.
        strict_qos: Whether endpoints that do not say so themselves match no incompatible ones.
        labels: Texts for users and tools, by name.
        declared: Whether the broker of this session has accepted or refused the node.
        refusal: Why it has refused it; "" if it has not.
        endpoints: The node's publishers, subscriptions, services, clients and graph watches.
        departing: The queues of destroyed publishers.
        warnings: Limits the warnings that other nodes can cause.
        stop: Ends the node with an error; set by the node.
    """

    owns_link = True

    def __init__(
        self,
        *,
        name: str,
        namespace: str,
        log: Logger,
        link: Link,
        default_call_timeout_sec: float,
        stop_on_error: bool,
        slow_callback_sec: float | None = SLOW_CALLBACK_SEC,
        shared_name: bool = False,
        strict_qos: bool = False,
        labels: Mapping[str, str],
    ) -> None:
        self.name = name
        self.namespace = namespace
        self.full_name = full_node_name(namespace, name)
        self.log = log
        self.link = link
        self.mailbox = Mailbox()
        self.ros_time = RosTime(self._jump_callback_failed)
        self.clock = Clock(ClockType.ROS_TIME, ros_time=self.ros_time)
        self.ros_time.followers[self._clock_jumped] = None
        self.watch = Stopwatch(log.warning, slow_sec=slow_callback_sec)
        self.default_call_timeout_sec = default_call_timeout_sec
        self.callback_errors = 0
        self.shared_name = shared_name
        self.strict_qos = strict_qos
        self.labels: dict[str, str] = dict(labels)
        self.destroyed = False
        self.stopping = False
        self.declared = False
        self.refusal = ""
        self.unread = 0
        self.endpoints: dict[NodeEndpoint, None] = {}
        self.timers: dict[NodeTimer, None] = {}
        self.departing = DepartingQueues(link, log)
        self.warnings = LimitedLines(log.warning)
        self.stop: Callable[[Exception], None] = _ignore
        self._stop_on_error = stop_on_error
        link.add(self)

    def require_alive(self) -> None:
        """Raise NodeDestroyed if the node has been destroyed."""
        if self.destroyed:
            raise NodeDestroyed(f"Node '{self.full_name}' has been destroyed")

    def leaves_after(self, endpoint: LinkEndpoint) -> None:
        """Note a publisher or service that was destroyed, perhaps before all of its messages are sent.

        A node with a link of its own sends everything before it closes the link.
        """

    def callback_failed(self, what: str, error: BaseException) -> None:
        """Log an error of a callback with its traceback, count it, and stop the node if that is wanted."""
        if self.mailbox.cancelling and isinstance(error, asyncio.CancelledError):
            return  # the node itself has cancelled it, to stop
        self.callback_errors += 1
        add_keyword_hint(error)
        self.log.error(f"{what} raised {type(error).__name__}: {error_text(error)}", exc_info=error)
        if self._stop_on_error and isinstance(error, Exception):
            self.stop(error)

    def _jump_callback_failed(self, error: BaseException) -> None:
        if isinstance(error, ENDS_PROGRAM):
            self.mailbox.end_program(error)
        else:
            self.callback_failed("a jump callback", error)

    def time(self) -> float:
        """Return the time that lifespans are measured in: seconds of the loop, or of simulated time."""
        ros_time = self.ros_time
        return ros_time.time() / NANOSECONDS_PER_SECOND if ros_time.active else self._loop.time()

    def _clock_jumped(self, change: ClockChange, delta: int) -> None:
        """Keep what is left of lifespans when another time goes on, or time goes back."""
        if change is not ClockChange.ROS_TIME_NO_CHANGE:
            if self.link.loop is None:
                return
            delta = self.ros_time.time() - round(self.link.loop.time() * NANOSECONDS_PER_SECOND)
            delta = delta if self.ros_time.active else -delta
        for endpoint in self.endpoints:
            endpoint.time_shifted(delta / NANOSECONDS_PER_SECOND)

    def require_loop(self) -> asyncio.AbstractEventLoop:
        """Return the loop that the node runs on; raise RuntimeError if it does not, or in another thread."""
        self.link.require_thread()
        loop = self.link.loop
        if self.destroyed:
            self.require_alive()
        if loop is None:
            raise RuntimeError(
                f"Node '{self.full_name}' is not running: use `async with node:` or actors.run()"
            )
        return loop

    def limit_sec(self, timeout_sec: Timeout) -> float:
        """Return a time limit in seconds: the node's for `DEFAULT_TIMEOUT`, infinity for None."""
        if timeout_sec is None:
            return math.inf
        return self.default_call_timeout_sec if isinstance(timeout_sec, DefaultTimeout) else timeout_sec

    async def wait_until(self, condition: Callable[[], bool], failure: str, timeout_sec: Timeout) -> None:
        """Wait until `condition` holds; check it whenever the link changes.

        Args:
            condition: What to wait for.
            failure: What is wrong when it does not hold in time, for the error: "'/add' has no server".
            timeout_sec: The time limit.

        Raises:
            WaitTimeout: It does not hold within `timeout_sec`.
        """
        self.require_loop()
        limit = self.limit_sec(timeout_sec)
        with in_flight():
            try:
                async with time_limit(limit):
                    while not condition():
                        await self.link.changed()
                        self.require_alive()
            except TimeoutError as error:
                raise WaitTimeout(f"{failure} after {limit:g} s") from error

    def declared_qos(self, name: str, profile: QoSProfile, *, strict_qos: bool | None) -> frames.Options:
        """Return the QoS map for an endpoint's declaration; warn if the broker does not know strict QoS.

        Args:
            name: The full name of its topic.
            profile: Its QoS.
            strict_qos: Whether it matches no incompatible endpoints; None is the node's default.
        """
        strict = self.strict_qos if strict_qos is None else strict_qos
        knows = Capability.STRICT_QOS in self.link.capabilities
        if strict and not knows and self.may_log("brokers without strict QoS"):
            self.log.warning(
                f"'{name}': the broker at {self.link.url} does not know strict QoS; it delivers messages"
                " between incompatible endpoints all the same"
            )
        return profile.to_wire(strict=strict)

    def declaration(self) -> frames.Frame:
        """Declare the node; warn if the broker does not know shared names."""
        knows = Capability.SHARED_NAMES in self.link.capabilities
        if self.shared_name and not knows and self.may_log("brokers without shared names"):
            text = f"The broker at {self.link.url} does not know shared node names; it allows one node"
            self.log.warning(f"{text} '{self.full_name}'")
        return frames.Node(self.id, self.full_name, self.shared_name, self.labels)

    def accepted(self, number: int) -> None:
        """Note that the node is in the graph."""
        del number
        self.declared = self.link.has_had_name = True
        self.link.waits_for_name = False
        self.link.wake()

    def refused(self, code: int, text: str) -> None:
        """Log that the broker has refused the node."""
        del code
        self.declared = True
        self.refusal = text or "it gives no reason"
        self.link.wake()
        if self.may_log("refusals of the broker"):
            self.log.error(f"The broker refused this node: {text}")

    def notice(self, notice: frames.Notice) -> None:
        """Log a warning of the broker."""
        self.warn_of(notice)

    def warn_of(self, notice: frames.Notice) -> None:
        """Log a notice, unless there were many of its kind: other nodes can cause any number of them."""
        kind = NoticeKind(notice.kind).name if notice.kind in set(NoticeKind) else "UNKNOWN"
        if self.may_log(f"{kind} notices"):
            self.log.warning(notice.text)

    def may_log(self, reason: str) -> bool:
        """Return whether to log a line that the broker or another node has caused; count it if not."""
        return self.warnings.admits(reason)

    @property
    def _loop(self) -> asyncio.AbstractEventLoop:
        assert self.link.loop is not None
        return self.link.loop

    def session_ended(self) -> None:
        """Forget the declaration, and publishers that can send nothing more."""
        self.declared = False
        self.refusal = ""
        self.departing.session_ended()


def time_limit(seconds: float) -> asyncio.Timeout:
    """Return `asyncio.timeout`, which takes no infinity."""
    return asyncio.timeout(None if seconds == math.inf else seconds)


class in_flight:  # noqa: N801 - reads as a statement
    """While inside, the running callback has a callboard call in flight (see `mailbox.py`)."""

    __slots__ = ("_callback_task",)

    def __enter__(self) -> None:
        self._callback_task = current_callback_task.get()
        if self._callback_task is not None:
            self._callback_task.call_started()

    def __exit__(self, *_: object) -> None:
        if self._callback_task is not None:
            self._callback_task.call_ended()


def _ignore(error: Exception) -> None:
    del error
