"""The workloads as data: their roles, parameters and figures."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Final

from benchmarks.harness import outcomes

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from benchmarks.harness.outcomes import Outcome


@dataclass(frozen=True, kw_only=True)
class Figure:
    """A column of the report."""

    key: str
    title: str
    more_is_better: bool = True


@dataclass(frozen=True, kw_only=True)
class Part:
    """One role's part in a case, in a process of its own."""

    role: str
    parameters: Mapping[str, object] = field(default_factory=dict[str, object])
    held: bool = False
    """Whether it runs until its stdin is closed, after all others have ended."""


@dataclass(frozen=True, kw_only=True)
class Case:
    """One configuration. Parts start in this order: consumers first."""

    name: str
    parts: tuple[Part, ...]
    measure: Callable[[Outcome], dict[str, float]]
    needs: frozenset[str] = frozenset()
    """Abilities of the roles that not all contenders have."""
    connections: int = 0
    """Idle connections that are held while the server is measured, instead of a load."""
    extra_s: float = 0.0
    """Its time in addition to the load, for the progress bar."""
    curve: tuple[str, int] | None = None
    """A point of a curve: the varied thing, and its number."""
    once: bool = False
    """Whether it is not repeated, because it takes long or has many points."""


@dataclass(frozen=True, kw_only=True)
class Workload:
    """Cases with figures that can be compared."""

    id: str
    title: str
    figures: tuple[Figure, ...]
    cases: tuple[Case, ...]


RATE: Final = Figure(key="rate", title="msg/s")
MB_S: Final = Figure(key="mb_s", title="MB/s")
SIZES: Final = {
    "16 B": 16,
    "256 B": 256,
    "4 KiB": 4096,
    "64 KiB": 65_536,
    "1 MiB": 1_048_576,
    "8 MiB": 8_388_608,
}
IN_FLIGHT: Final = 100
IMU_BYTES: Final = 324
"""An Imu's content: 37 numbers of 8 bytes, a time stamp and its frame's name."""
PER_SECOND: Final = 1000
PACED_PER_SECOND: Final = 500
STREAM_MB_S: Final = 50
FILLING: Final = 48
"""Characters that make a small message 64 bytes."""
GROWTH: Final = (1, 10, 100, 1000)
PENDING: Final = (1, 1000, 10_000, 100_000)
BURST: Final = 200
"""Messages published in one loop turn."""
FEEDBACK_MESSAGES: Final = 10_000
"""Feedback messages of a goal."""
LOG_BURST: Final = 100
"""Lines logged in one loop turn."""
DELIVERIES: Final = 400_000
"""Deliveries of a trial with many subscribers, all of them together."""


def _stream(name: str, *, readers: int = 1, copies: int = 1, **message: object) -> Case:
    """One publisher; `readers` subscriber processes with `copies` subscriptions each."""
    subscribers = [
        Part(role="subscriber", parameters={**message, "subscriptions": copies, "number": number})
        for number in range(readers)
    ]
    publisher = Part(role="publisher", parameters={**message, "readers": readers})
    return Case(name=name, parts=(*subscribers, publisher), measure=outcomes.stream)


def _requests(name: str, in_flight: int) -> Case:
    requester = Part(role="requester", parameters={"in_flight": in_flight})
    return Case(name=name, parts=(Part(role="server", held=True), requester), measure=outcomes.requests)


def _actions(name: str, in_flight: int, **parameters: object) -> Case:
    sender = Part(role="goal_sender", parameters={"in_flight": in_flight, **parameters})
    return Case(name=name, parts=(Part(role="action_server", held=True), sender), measure=outcomes.actions)


def _logs(name: str, *, readers: int = 0, rosout: bool = True, burst: int = LOG_BURST) -> Case:
    writer = Part(role="log_writer", parameters={"readers": readers, "rosout": rosout, "burst": burst})
    parts = (*[Part(role="log_reader")] * readers, writer)
    return Case(name=name, parts=parts, measure=outcomes.logs)


def _typed(name: str, size: int, kind: str, *, anew: bool = False) -> Case:
    """One publisher, one subscriber of a message type that only callboard knows."""
    return replace(_stream(name, size=size, kind=kind, anew=anew), needs=frozenset({"types"}))


def _paced(name: str, size: int) -> Case:
    """A stream of messages one by one, slow enough that the broker waits for each."""
    stream = _stream(name, size=size, kind="array", burst=1, mb_s=PACED_PER_SECOND * size / 1e6)
    return replace(stream, needs=frozenset({"pace"}))


def _idle(connections: int) -> Case:
    part = Part(role="idle", parameters={"connections": connections}, held=True)
    return Case(
        name=f"{connections:,}",
        parts=(part,),
        measure=outcomes.idle,
        connections=connections,
        extra_s=9.0,
        once=True,
    )


def _mixed(name: str, size: int = 0) -> Case:
    """Small messages at a pace; `size` is that of the stream's messages, 0 for none."""
    small: dict[str, object] = {"per_second": PER_SECOND, "filling": FILLING}
    parts = (Part(role="listener"), Part(role="pacer", parameters=small))
    beside = _stream(name, size=size, mb_s=STREAM_MB_S).parts if size else ()
    return Case(name=name, parts=(*beside, *parts), measure=outcomes.mixed)


def _grown(what: str, count: int, *parts: Part) -> Case:
    return Case(
        name=f"{what}: {count:,}",
        parts=parts,
        measure=outcomes.growth,
        needs=frozenset({"growth"}),
        curve=(what, count),
        once=True,
    )


def _topics(what: str, topics: int, burst: int) -> Case:
    """Topics in turn. With a burst of 1 each message has its own frame, for any number of topics."""
    parameters = {"topics": topics, "size": 256, "burst": burst}
    subscriber = Part(role="topics_subscriber", parameters=parameters)
    return _grown(what, topics, subscriber, Part(role="topics_publisher", parameters=parameters))


def _crowd(readers: int) -> Case:
    """Subscribers in nodes of their own, in two processes, with the same deliveries in all."""
    processes = min(2, readers)
    share = readers // processes
    stream = _stream(
        "", readers=processes, copies=share, nodes=share, size=256, messages=DELIVERIES // readers
    )
    return _grown("subscribers", readers, *stream.parts)


def _services(what: str, services: int, in_flight: int) -> Case:
    """Services in turn. With 1 in flight each call has its own frame, for any number of services."""
    parameters = {"services": services, "in_flight": in_flight}
    server = Part(role="server", parameters=parameters, held=True)
    return _grown(what, services, server, Part(role="requester", parameters=parameters))


def _pending(pending: int) -> Case:
    waiting = (
        Part(role="holder", held=True),
        Part(role="hoarder", parameters={"pending": pending}, held=True),
    )
    return _grown("pending requests", pending, *waiting, *_requests("", IN_FLIGHT).parts)


WORKLOADS: Final = (
    Workload(
        id="W1",
        title="one publisher, one subscriber, KEEP_ALL, nothing lost",
        figures=(RATE, MB_S),
        cases=tuple(_stream(name, size=size) for name, size in SIZES.items()),
    ),
    Workload(
        id="W2",
        title="one publisher, 10 subscribers in 2 processes",
        figures=(Figure(key="rate", title="delivered msg/s"),),
        cases=(
            _stream("256 B", readers=2, copies=5, size=256),
            _stream("1 MiB", readers=2, copies=5, size=1_048_576),
        ),
    ),
    Workload(
        id="W3",
        title="add_two_ints, one call at a time",
        figures=(
            Figure(key="p50_us", title="p50 us", more_is_better=False),
            Figure(key="p99_us", title="p99 us", more_is_better=False),
            Figure(key="p999_us", title="p99.9 us", more_is_better=False),
        ),
        cases=(_requests("1 in flight", 1),),
    ),
    Workload(
        id="W4",
        title="add_two_ints, 100 calls in flight",
        figures=(Figure(key="rate", title="req/s"),),
        cases=(_requests("100 in flight", IN_FLIGHT),),
    ),
    Workload(
        id="W5",
        title="idle connections",
        figures=(
            Figure(key="connections", title="connections"),
            Figure(key="kib", title="KiB per connection", more_is_better=False),
            Figure(key="idle_cpu_percent", title="idle CPU %", more_is_better=False),
        ),
        cases=(_idle(1000), _idle(10_000)),
    ),
    Workload(
        id="W6",
        title="typed messages",
        figures=(RATE, MB_S),
        cases=(
            _typed("std_msgs/String 256 B", 256, "plain"),
            _typed("std_msgs/UInt8MultiArray 256 B", 256, "array"),
            _typed("std_msgs/UInt8MultiArray 256 B, each made anew", 256, "array", anew=True),
            _typed("sensor_msgs/Imu", IMU_BYTES, "imu"),
            _typed("sensor_msgs/Image 1 MB", 1_000_000, "image"),
            _typed("sensor_msgs/PointCloud2 1 MB", 1_000_000, "point_cloud"),
        ),
    ),
    Workload(
        id="W7",
        title=f"{PER_SECOND:,} messages/s of 64 B beside a stream of {STREAM_MB_S} MB/s",
        figures=(
            Figure(key="p50_us", title="delay p50 us", more_is_better=False),
            Figure(key="p99_us", title="delay p99 us", more_is_better=False),
            Figure(key="mb_s", title="stream MB/s"),
        ),
        cases=(_mixed("no stream"), _mixed("64 KiB messages", 65_536), _mixed("1 MiB messages", 1_048_576)),
    ),
    Workload(
        id="W8",
        title="growth: CPU of all roles together for each message or call",
        figures=(
            Figure(key="cost_us", title="us CPU in all", more_is_better=False),
            Figure(key="rate", title="per second"),
        ),
        cases=(
            *(_topics("topics", topics, 1) for topics in GROWTH),
            *(_topics("topics in bursts", topics, BURST) for topics in GROWTH),
            *(_crowd(readers) for readers in GROWTH),
            *(_services("services", services, 1) for services in GROWTH),
            *(_services("services, 100 in flight", services, IN_FLIGHT) for services in GROWTH),
            *(_pending(pending) for pending in PENDING),
        ),
    ),
    Workload(
        id="W9",
        title="actions: goals one at a time and 100 in flight, and the feedback of one goal",
        figures=(
            Figure(key="rate", title="per second"),
            Figure(key="p50_us", title="p50 us of a goal", more_is_better=False),
        ),
        cases=(
            _actions("goals, 1 in flight", 1),
            _actions("goals, 100 in flight", IN_FLIGHT),
            _actions("feedback messages", 1, feedback=FEEDBACK_MESSAGES),
        ),
    ),
    Workload(
        id="W10",
        title="logs: lines on /rosout, and what a log call costs without it and without a reader",
        figures=(
            Figure(key="rate", title="lines/s"),
            Figure(key="call_us", title="us CPU of a log call", more_is_better=False),
            Figure(key="lost_percent", title="lost %", more_is_better=False),
        ),
        cases=(
            _logs("a reader", readers=1),
            _logs("a reader, one line a turn", readers=1, burst=1),
            _logs("nobody listens"),
            _logs("nobody listens, one line a turn", burst=1),
            _logs("rosout off", rosout=False),
            _logs("rosout off, one line a turn", rosout=False, burst=1),
        ),
    ),
    Workload(
        id="W11",
        title="two nodes of one process: publisher and subscriber, server and requester",
        figures=(RATE, MB_S, Figure(key="p50_us", title="p50 us of a call", more_is_better=False)),
        cases=(
            *(
                Case(
                    name=name,
                    parts=(Part(role="stream_together", parameters={"size": SIZES[name]}),),
                    measure=outcomes.alone,
                )
                for name in ("256 B", "64 KiB", "1 MiB", "8 MiB")
            ),
            Case(
                name="one call at a time",
                parts=(Part(role="calls_together", parameters={"in_flight": 1}),),
                measure=outcomes.alone,
            ),
        ),
    ),
    Workload(
        id="W12",
        title=f"{PACED_PER_SECOND} messages a second, one by one: what each costs",
        figures=(RATE,),
        cases=tuple(_paced(name, SIZES[name]) for name in ("256 B", "64 KiB", "1 MiB")),
    ),
)
