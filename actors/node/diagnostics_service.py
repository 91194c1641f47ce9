"""The service `~/get_diagnostics`: where a node runs, for how long, and what its callbacks take."""

from __future__ import annotations

import os
import socket
from typing import TYPE_CHECKING, Final

from actors.endpoints.service.idle import IdleService
from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.callboard_interfaces.msg import CallbackTimes
from actors.interfaces.callboard_interfaces.srv import GetDiagnostics
from proto.errors import InvalidServiceNameError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from actors.arguments.remapping import Remapper
    from actors.diagnostics.records import CallbackDiagnostics, NodeDiagnostics
    from actors.endpoints.context import NodeContext

MAX_CALLBACKS: Final = 1000
"""Callbacks in one response."""


class DiagnosticsService:
    """The service of one node.

    Args:
        context: The node.
        names: Expands and remaps the service's name.
        diagnose: Returns the node's state and counts.
    """

    def __init__(
        self, context: NodeContext, names: Remapper, diagnose: Callable[[], NodeDiagnostics]
    ) -> None:
        self._diagnose = diagnose
        try:
            full_name = names.resolve_service("~/get_diagnostics")
        except InvalidServiceNameError as error:
            context.log.warning(f"The node's name is too long for its diagnostics service: {error}")
            return
        # Concurrent: the node most worth asking is the one whose mailbox is held by a callback that does
        # not end.
        IdleService(context, GetDiagnostics, full_name, callback=self._answer, concurrent=True)

    def _answer(self, _: GetDiagnostics.Request) -> GetDiagnostics.Response:
        found = self._diagnose()
        # The busiest first: they are what is looked for, and the end of the list may be cut.
        called = sorted(_called(found), key=lambda each: each.busy_sec, reverse=True)
        sec, nanosec = divmod(found.stamp_ns, 1_000_000_000)
        return GetDiagnostics.Response(
            host=socket.gethostname(),
            pid=os.getpid(),
            stamp=Time(sec=sec, nanosec=nanosec),
            uptime_sec=found.uptime_sec,
            connections=found.connections,
            callback_errors=found.callback_errors,
            loop_lag_sec=found.loop_lag.last_sec,
            longest_loop_lag_sec=found.loop_lag.longest_sec,
            callbacks=called[:MAX_CALLBACKS],
            omitted_callbacks=max(0, len(called) - MAX_CALLBACKS),
        )


def _called(node: NodeDiagnostics) -> Iterator[CallbackTimes]:
    for kind, source, callback in _callbacks(node):
        if callback.calls:
            yield CallbackTimes(
                kind=kind,
                source=source,
                name=callback.name,
                calls=callback.calls,
                busy_sec=callback.busy_sec,
                longest_sec=callback.longest_sec,
                longest_elapsed_sec=callback.longest_elapsed_sec,
                slow=callback.slow,
            )


def _callbacks(node: NodeDiagnostics) -> Iterator[tuple[str, str, CallbackDiagnostics]]:
    for subscription in node.subscriptions:
        if subscription.callback is not None:
            yield "subscription", subscription.topic, subscription.callback
    for service in node.services:
        yield "service", service.service, service.callback
    for timer in node.timers:
        yield "timer", "", timer.callback
    for publisher in node.publishers:
        for event in publisher.events:
            yield "event", publisher.topic, event
    for subscription in node.subscriptions:
        for event in subscription.events:
            yield "event", subscription.topic, event
