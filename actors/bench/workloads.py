"""The workloads as data: which roles play, with what parameters, and what their figures say."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Final

from actors.bench import outcomes

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from actors.bench.outcomes import Outcome


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
    """Ends when its stdin is closed, which is when all others have ended."""


@dataclass(frozen=True, kw_only=True)
class Case:
    """One configuration that is measured. Parts start in this order: consumers first."""

    name: str
    parts: tuple[Part, ...]
    measure: Callable[[Outcome], dict[str, float]]
    connections: int = 0
    """Idle connections: the server is measured while they are held, instead of a load."""
    extra_s: float = 0.0
    """What it takes beyond the load, for the progress bar."""
    quick: bool = True
    """Belongs to what `callboard bench` does when nobody says what."""


@dataclass(frozen=True, kw_only=True)
class Workload:
    """Cases with figures that can be compared."""

    id: str
    title: str
    figures: tuple[Figure, ...]
    cases: tuple[Case, ...]


RATE: Final = Figure(key="rate", title="msg/s")
MB_S: Final = Figure(key="mb_s", title="MB/s")
SIZES: Final = {"16 B": 16, "256 B": 256, "4 KiB": 4096, "64 KiB": 65_536, "1 MiB": 1_048_576}
IN_FLIGHT: Final = 100


def _stream(name: str, *, readers: int = 1, copies: int = 1, **message: object) -> Case:
    """One publisher; `readers` subscriber processes with `copies` subscriptions each."""
    hearing = [
        Part(role="subscriber", parameters={**message, "subscriptions": copies, "number": number})
        for number in range(readers)
    ]
    speaking = Part(role="publisher", parameters={**message, "readers": readers})
    return Case(name=name, parts=(*hearing, speaking), measure=outcomes.stream)


def _requests(name: str, in_flight: int) -> Case:
    asking = Part(role="requester", parameters={"in_flight": in_flight})
    return Case(name=name, parts=(Part(role="server", held=True), asking), measure=outcomes.requests)


def _idle(connections: int) -> Case:
    part = Part(role="idle", parameters={"connections": connections}, held=True)
    return Case(
        name=f"{connections:,}",
        parts=(part,),
        measure=outcomes.idle,
        connections=connections,
        extra_s=9.0,
        quick=connections <= 1000,
    )


WORKLOADS: Final = (
    Workload(
        id="W1",
        title="one publisher, one subscriber, KEEP_ALL, nothing lost",
        figures=(RATE, MB_S),
        cases=tuple(_stream(name, size=size) for name, size in SIZES.items()),
    ),
    Workload(
        id="W2",
        title="one publisher, 10 subscribers in 2 processes, 256 B",
        figures=(Figure(key="rate", title="delivered msg/s"),),
        cases=(_stream("256 B", readers=2, copies=5, size=256),),
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
)


def chosen(ids: Sequence[str]) -> list[Workload]:
    """Return the workloads with these ids, whole; without ids, the quick cases of all."""
    if ids:
        return [workload for workload in WORKLOADS if workload.id in ids]
    quick = [
        replace(workload, cases=tuple(case for case in workload.cases if case.quick))
        for workload in WORKLOADS
    ]
    return [workload for workload in quick if workload.cases]
