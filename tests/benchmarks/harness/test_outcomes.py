"""What reports come to, and that a trial which lost something has no figures."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from benchmarks.harness import outcomes
from benchmarks.harness.errors import TrialError
from benchmarks.harness.outcomes import Outcome, Played
from benchmarks.harness.roles.stream import Count


def streamed(*received: int, sent: int = 100, lost: int = 0) -> Outcome:
    """A publisher and subscribers with two subscriptions each."""
    speaking = Played(
        role="publisher",
        parameters={"size": 1000},
        figures={"sent": sent, "messages": sent, "cpu_s": 0.001},
    )
    hearing = [
        Played(
            role="subscriber",
            parameters={"subscriptions": 2},
            figures={"received": n, "messages": n, "cpu_s": 0.004, "elapsed_s": 2.0, "lost": lost},
        )
        for n in received
    ]
    return Outcome(played=(*hearing, speaking), server_cpu_s=0.02)


def test_a_stream_counts_every_delivery() -> None:
    """Publishers cost by messages sent, brokers and subscribers by deliveries."""
    figures = outcomes.stream(streamed(200, 200))
    assert figures["rate"] == 200.0
    assert figures["mb_s"] == pytest.approx(0.2)
    assert figures["cpu_us.publisher"] == pytest.approx(10.0)
    assert figures["cpu_us.broker"] == pytest.approx(50.0)
    assert figures["cpu_us.subscriber"] == pytest.approx(20.0)


@pytest.mark.parametrize("outcome", [streamed(200, 199), streamed(201, 200), streamed(200, lost=1)])
def test_a_stream_with_losses_has_no_figures(outcome: Outcome) -> None:
    """One message too few, one too many, or one that a counter knows of."""
    with pytest.raises(TrialError, match="lost messages"):
        outcomes.stream(outcome)


@pytest.mark.parametrize("figures", [{"sent": 9}, {"sent": 10, "lost": 1}])
def test_roles_of_one_process_that_lose_messages_have_no_figures(figures: dict[str, int]) -> None:
    """As if they were apart."""
    common = {"messages": 10, "received": 10, "cpu_s": 1.0, "rate": 5.0}
    both = Played(role="stream_together", parameters={"size": 1000}, figures={**common, "sent": 10})
    assert outcomes.alone(Outcome(played=(both,), server_cpu_s=None)) == {
        "rate": 5.0,
        "mb_s": 0.005,
        "cpu_us.stream_together": 100_000.0,
    }
    lost = Played(role="stream_together", parameters={"size": 1000}, figures={**common, **figures})
    with pytest.raises(TrialError, match="lost messages"):
        outcomes.alone(Outcome(played=(lost,), server_cpu_s=None))


def paced(received: int, *beside: Played) -> Outcome:
    """A pacer of 100 messages, a listener that received so many of them, and perhaps a stream."""
    pacer = Played(role="pacer", parameters={}, figures={"sent": 100, "messages": 100, "cpu_s": 0.001})
    figures = {"received": received, "messages": received, "cpu_s": 0.002, "p50_us": 5.0, "p99_us": 9.0}
    return Outcome(
        played=(*beside, Played(role="listener", parameters={}, figures=figures), pacer), server_cpu_s=1.0
    )


def test_paced_messages_have_latencies_and_the_rate_of_the_stream_beside_them() -> None:
    """The rate is 0 without a stream."""
    figures = {"p50_us": 5.0, "p99_us": 9.0, "cpu_us.pacer": 10.0, "cpu_us.listener": 20.0}
    assert outcomes.mixed(paced(100)) == {**figures, "mb_s": 0.0}
    assert outcomes.mixed(paced(100, *streamed(200).played)) == {**figures, "mb_s": pytest.approx(0.1)}


@pytest.mark.parametrize(
    "outcome",
    [paced(99), paced(101), paced(100, *streamed(199).played), paced(100, *streamed(200, lost=1).played)],
)
def test_paced_messages_with_losses_have_no_figures(outcome: Outcome) -> None:
    """One too few, one too many, or one that the stream beside them lost."""
    with pytest.raises(TrialError, match="lost messages"):
        outcomes.mixed(outcome)


@pytest.mark.parametrize("counter", ["lost", "lost_on_break", "dropped", "undecodable"])
def test_a_subscriber_reports_whatever_its_subscriptions_lost(counter: str) -> None:
    """Each counter of each subscription is added."""
    counters = dict.fromkeys(("lost", "lost_on_break", "dropped", "undecodable"), 0)
    subscriptions: list[Any] = [SimpleNamespace(**counters), SimpleNamespace(**{**counters, counter: 3})]
    assert Count(2).figures(subscriptions)["lost"] == 3


def test_without_a_server_there_is_no_brokers_cost() -> None:
    """Rather than a zero."""
    direct = Outcome(played=streamed(200).played, server_cpu_s=None)
    assert "cpu_us.broker" not in outcomes.stream(direct)


def test_idle_connections_must_last() -> None:
    """A connection that either side has lost is no idle connection."""

    def held(alive: int, files: int | None) -> Outcome:
        player = Played(role="idle", parameters={"connections": 10}, figures={"connections": alive})
        return Outcome(played=(player,), server_cpu_s=0.05, server_kib=40.0, server_files=files, window_s=5.0)

    for files in (None, 10):
        assert outcomes.idle(held(10, files)) == {"connections": 10, "kib": 4.0, "idle_cpu_percent": 1.0}
    for outcome in (held(9, None), held(10, 9)):
        with pytest.raises(TrialError, match="9 of 10"):
            outcomes.idle(outcome)
