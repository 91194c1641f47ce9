"""Computes a trial's figures from the reports of its roles. A trial that lost messages has none."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from benchmarks.harness.errors import TrialError

if TYPE_CHECKING:
    from collections.abc import Mapping

CPU: Final = "cpu_us."
"""Before a role's name: the key of its CPU time per message, in us. The server's role is `broker`."""


@dataclass(frozen=True, kw_only=True)
class Played:
    """A role with its parameters and its reported figures."""

    role: str
    parameters: Mapping[str, Any]
    figures: Mapping[str, Any]


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """A whole trial. The server's numbers are None if there is no server, or if they are unknown."""

    played: tuple[Played, ...]
    server_cpu_s: float | None
    server_kib: float | None = None
    """Growth of its memory while idle connections were made."""
    server_files: int | None = None
    """Growth of its open descriptors in that time."""
    window_s: float = 0.0
    """Length of the measurement while they were held."""

    def all(self, role: str) -> list[Played]:
        """Return the reports of a role."""
        return [each for each in self.played if each.role == role]

    def only(self, role: str) -> Played:
        """Return the only report of a role."""
        (found,) = self.all(role)
        return found

    def broker_cost(self, messages: float) -> dict[str, float]:
        """Return the server's CPU time for each of `messages`."""
        return {} if self.server_cpu_s is None else {f"{CPU}broker": 1e6 * self.server_cpu_s / messages}


def cost(*players: Played) -> dict[str, float]:
    """Return the CPU time of a role per message."""
    messages = sum(each.figures["messages"] for each in players)
    if not messages:
        raise TrialError(f"{players[0].role} handled nothing")
    return {f"{CPU}{players[0].role}": 1e6 * sum(each.figures["cpu_s"] for each in players) / messages}


def stream(outcome: Outcome) -> dict[str, float]:
    """Return the rates of a publisher and its subscribers."""
    publisher, subscribers = outcome.only("publisher"), outcome.all("subscriber")
    sent: int = publisher.figures["sent"]
    for each in subscribers:
        due = sent * each.parameters["subscriptions"]
        received, lost = each.figures["received"], each.figures["lost"]
        if received != due or lost or publisher.figures.get("lost"):
            raise TrialError(f"lost messages: {received} of {due} received, {lost} counted as lost")
    received = sum(each.figures["received"] for each in subscribers)
    if received < 2 * len(subscribers):
        raise TrialError("too few messages for a rate: use more seconds")
    rate = received / max(each.figures["elapsed_s"] for each in subscribers)
    return {
        "rate": rate,
        "mb_s": rate * publisher.parameters["size"] / 1e6,
        **cost(publisher),
        **outcome.broker_cost(received),
        **cost(*subscribers),
    }


def alone(outcome: Outcome) -> dict[str, float]:
    """Return the figures of two roles in one process: a stream's or a requester's."""
    (both,) = outcome.played
    figures = both.figures
    if figures.get("lost") or figures.get("sent", 0) != figures.get("received", 0):
        raise TrialError(f"lost messages: {figures['received']} of {figures['sent']} received")
    found = {key: figures[key] for key in ("rate", "p50_us", "p99_us", "p999_us") if key in figures}
    if size := both.parameters.get("size"):
        found["mb_s"] = figures["rate"] * size / 1e6
    return {**found, **cost(both), **outcome.broker_cost(figures["messages"])}


def requests(outcome: Outcome) -> dict[str, float]:
    """Return the rate and the latencies of calls."""
    requester, server = outcome.only("requester"), outcome.only("server")
    figures = {key: requester.figures[key] for key in ("rate", "p50_us", "p99_us", "p999_us")}
    # Served requests include the warm-up calls, as the server's CPU time does.
    served = server.figures["messages"]
    return {**figures, **cost(requester), **outcome.broker_cost(served), **cost(server)}


def actions(outcome: Outcome) -> dict[str, float]:
    """Return the rate of goals, or of feedback messages that arrived, and how long a goal takes."""
    sender, server = outcome.only("goal_sender"), outcome.only("action_server")
    figures = {key: sender.figures[key] for key in ("rate", "p50_us")}
    return {**figures, **cost(sender), **outcome.broker_cost(server.figures["messages"]), **cost(server)}


def logs(outcome: Outcome) -> dict[str, float]:
    """Return the rate of log lines that arrived, or were logged if nobody reads them, and what one costs."""
    writer, readers = outcome.only("log_writer"), outcome.all("log_reader")
    logged = writer.figures["messages"]
    for each in readers:
        if each.figures["received"] + each.figures["lost"] != logged:
            raise TrialError(
                f"of {logged} lines {each.figures['received']} arrived and {each.figures['lost']} were lost"
            )
    lost = max((each.figures["lost"] for each in readers), default=writer.figures["dropped"])
    return {
        "rate": min((each.figures["rate"] for each in readers), default=writer.figures["rate"]),
        "call_us": 1e6 * writer.figures["cpu_s"] / logged,
        "lost_percent": 100 * lost / logged,
        **cost(writer),
        **outcome.broker_cost(logged),
        **(cost(*readers) if readers else {}),
    }


def mixed(outcome: Outcome) -> dict[str, float]:
    """Return the latencies of small messages, and the rate of the stream beside them."""
    listener, pacer = outcome.only("listener"), outcome.only("pacer")
    received, sent = listener.figures["received"], pacer.figures["sent"]
    if received != sent:
        raise TrialError(f"lost messages: {received} of {sent} received")
    figures = {key: listener.figures[key] for key in ("p50_us", "p99_us")}
    beside = stream(outcome)["mb_s"] if outcome.all("subscriber") else 0.0
    return {**figures, "mb_s": beside, **cost(pacer), **cost(listener)}


def growth(outcome: Outcome) -> dict[str, float]:
    """Return the CPU time per delivered message or call, of all processes that do not only hold something."""
    working = [each for each in outcome.played if each.role not in {"holder", "hoarder"}]
    for each in outcome.all("hoarder"):
        if each.figures["messages"] != each.parameters["pending"]:
            raise TrialError("pending requests ended before the load")
    takers = [each for each in working if each.role in {"subscriber", "topics_subscriber", "server"}]
    for giver in outcome.all("topics_publisher"):
        received = takers[0].figures["received"]
        if received != giver.figures["sent"] or takers[0].figures["lost"]:
            raise TrialError(f"lost messages: {received} of {giver.figures['sent']} received")
    if outcome.all("publisher"):
        stream(outcome)  # raises if something was lost
    handled = sum(each.figures["messages"] for each in takers)
    if not handled:
        raise TrialError("nothing was handled")
    used_s = sum(each.figures["cpu_s"] for each in working) + (outcome.server_cpu_s or 0.0)
    rates = [each.figures["rate"] for each in working if "rate" in each.figures]
    return {"cost_us": 1e6 * used_s / handled, "rate": sum(rates), **outcome.broker_cost(handled)}


def idle(outcome: Outcome) -> dict[str, float]:
    """Return the server's cost of an idle connection."""
    player = outcome.only("idle")
    wanted, held = player.parameters["connections"], player.figures["connections"]
    if (
        outcome.server_files is not None
    ):  # the server may have closed connections that the client believes open
        held = min(held, outcome.server_files)
    if held < wanted:
        raise TrialError(f"only {held} of {wanted} idle connections lasted")
    figures: dict[str, float] = {"connections": held}
    if outcome.server_kib is not None:
        figures["kib"] = outcome.server_kib / held
    if outcome.server_cpu_s is not None:
        figures["idle_cpu_percent"] = 100 * outcome.server_cpu_s / outcome.window_s
    return figures
