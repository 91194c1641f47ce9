"""The queue of transitions that are requested of lifecycle nodes, one at a time for each node.

A lifecycle node refuses a transition while another one runs. So each request waits for the end of the one
before it, and `configure` and `activate` can be requested together.
"""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, Final

from actors.launch.engine.effects import CancelTransition, Effect, RequestTransition
from actors.launch.planning.events import Event, Level, Message
from actors.launch.planning.lifecycle import transition_label

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from actors.launch.planning.process_spec import ProcessSpec

MAX_WAITING: Final = 100
"""Limit of waiting sequences for one node, far beyond its seven transitions."""


class _Node:
    """A lifecycle node, and the transitions that are requested of it.

    Attributes:
        label: The label of its process.
        name: Its full name.
        timeout_sec: The limit of each transition.
        up: Whether its process runs.
        waiting: Sequences of transitions. If one fails, the rest of its sequence is dropped.
        request: The pending request: the first transition of the first sequence.
    """

    def __init__(self, process: ProcessSpec, timeout_sec: float) -> None:
        self.label = process.label
        self.name = process.node or ""
        self.timeout_sec = timeout_sec
        self.up = False
        self.waiting: deque[deque[int | str]] = deque()
        self.request: RequestTransition | None = None


class TransitionQueue:
    """The transitions that wait to be requested of the lifecycle nodes of a launch.

    Args:
        emit: Called with requests.
        notify: Called with messages.
    """

    def __init__(self, emit: Callable[[Effect], None], notify: Callable[[Event], None]) -> None:
        self._emit = emit
        self._notify = notify
        self._abandoned = False
        self._nodes: dict[str, _Node] = {}
        """By the labels of their processes, while these live."""

    def add(self, process: ProcessSpec, transitions: Iterable[int | str]) -> None:
        """Request transitions of a node after all earlier ones, once its process runs."""
        node = self._node(process)
        if node is None:
            return
        if self._abandoned:
            self._abandon(node)
        elif len(node.waiting) >= MAX_WAITING:
            self._failed(node, transitions, f"{MAX_WAITING} others wait already")
        else:
            node.waiting.append(deque(transitions))
            self._next(node)

    def started(self, process: ProcessSpec) -> None:
        """Handle that a process runs: request its autostart transitions, and then the waiting ones."""
        node = self._node(process)
        if node is None or process.lifecycle is None or self._abandoned:
            return
        node.up = True
        # At the front: transitions that were requested before the start, such as `deactivate`, follow it.
        if process.lifecycle.autostart:
            node.waiting.appendleft(deque(process.lifecycle.autostart))
        self._next(node)

    def ended(self, label: str) -> None:
        """Handle that a process has ended: drop the transitions of its node."""
        node = self._nodes.pop(label, None)
        if node is not None and node.waiting:
            self._failed(node, node.waiting[0], "its process has ended")
            self._cancel(node)

    def request_ended(self, request: RequestTransition, failure: str | None) -> None:
        """Handle the end of a request: None if it succeeded, otherwise the reason. Ignore an outdated one."""
        node = self._nodes.get(request.label)
        if node is None or node.request is not request:
            return
        node.request = None
        sequence = node.waiting[0]
        # The rest of a sequence needs the state that the failed transition would have led to.
        if failure is None:
            sequence.popleft()
        else:
            self._failed(node, sequence, failure)
            sequence.clear()
        if not sequence:
            node.waiting.popleft()
        self._next(node)

    def abandon(self) -> None:
        """Drop all transitions, and request no others, because the launch ends."""
        self._abandoned = True
        for node in self._nodes.values():
            if node.waiting:
                self._abandon(node)
                self._cancel(node)
        self._nodes.clear()

    def _node(self, process: ProcessSpec) -> _Node | None:
        if process.lifecycle is None:
            return None
        return self._nodes.setdefault(process.label, _Node(process, process.lifecycle.timeout_sec))

    def _next(self, node: _Node) -> None:
        """Request the next transition, unless one is pending."""
        if node.up and node.waiting and node.request is None:
            first = node.waiting[0][0]
            node.request = RequestTransition(node.label, node.name, first, node.timeout_sec)
            self._emit(node.request)

    def _cancel(self, node: _Node) -> None:
        if node.request is not None:
            self._emit(CancelTransition(node.request))

    def _abandon(self, node: _Node) -> None:
        text = f"Abandoning wait for the '{node.name}/change_state' service, due to shutdown."
        self._notify(Message(Level.WARN, text, node.label))

    def _failed(self, node: _Node, transitions: Iterable[int | str], reason: str) -> None:
        first, *others = map(transition_label, transitions)
        text = f"Failed to make transition '{first}' for LifecycleNode '{node.name}'"
        text += f": {reason}" if reason else ""
        text += f"; not requested: {', '.join(others)}" if others else ""
        self._notify(Message(Level.ERROR, text, node.label))
