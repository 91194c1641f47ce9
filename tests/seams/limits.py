"""Limits inside nodes and brokers that no argument reaches: tests make them small to reach them soon.

They are no options, because nobody but a test has a reason to change one of them alone.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from actors.actions import client_goal, server_endpoint
from actors.cli import broker_target, completion, hidden_node
from actors.endpoints import reply_order, service_introspection
from actors.endpoints.client import endpoint as client_endpoint
from actors.endpoints.client import refused_calls
from actors.endpoints.publisher import queue_limits
from actors.endpoints.service import endpoint as service_endpoint
from actors.endpoints.subscription import credit
from actors.graph import inspector
from actors.launch.engine import watching
from actors.processes import child_events, local_broker
from actors.session import connector, first_attempt
from actors.testing import fault_proxy
from actors.threads import loop_thread
from broker.mesh.engine import member
from broker.serving import inspections, presence_log, probe
from tests.waiting import DEADLINE_SEC

if TYPE_CHECKING:
    from types import ModuleType

    import pytest

_HOMES: Final[dict[str, tuple[ModuleType, str]]] = {
    "window_messages": (credit, "WINDOW_MESSAGES"),
    "window_least_bytes": (credit, "LEAST_BYTES"),
    "window_shared_bytes": (credit, "SHARED_BYTES"),
    "keep_all_messages": (queue_limits, "KEEP_ALL_MESSAGES"),
    "keep_all_bytes": (queue_limits, "KEEP_ALL_BYTES"),
    "ready_messages": (queue_limits, "READY_MESSAGES"),
    "ready_bytes": (queue_limits, "READY_BYTES"),
    "pending_calls": (client_endpoint, "MAX_PENDING"),
    "refused_calls": (refused_calls, "MAX_REFUSED"),
    "refused_call_delay_sec": (refused_calls, "_MIN_DELAY_SEC"),
    "queued_requests": (service_endpoint, "MAX_QUEUED"),
    "running_requests": (service_endpoint, "MAX_RUNNING"),
    "goals": (server_endpoint, "MAX_GOALS"),
    "feedback_depth": (client_goal, "FEEDBACK_DEPTH"),
    "feedback_wait_sec": (reply_order, "MAX_WAIT_SEC"),
    "first_answer_sec": (first_attempt, "FIRST_ANSWER_SEC"),
    "first_retry_sec": (connector, "FIRST_RETRY_SEC"),
    "reconnect_sec": (connector, "LAST_RETRY_SEC"),
    "thread_calls": (loop_thread, "MAX_CALLS"),
    "thread_grace_sec": (loop_thread, "GRACE_SEC"),
    "child_events": (child_events, "WATCHER_EVENTS"),
    "inspector_stay_sec": (inspector, "_STAY_SEC"),
    "proxied_connections": (fault_proxy, "MAX_CONNECTIONS"),
    "connect_sec": (broker_target, "CONNECT_TIMEOUT_SEC"),
    "connect_node_sec": (hidden_node, "CONNECT_TIMEOUT_SEC"),
    "completion_broker_sec": (completion, "BROKER_TIMEOUT_SEC"),
    "completion_parameters_sec": (completion, "PARAMETERS_TIMEOUT_SEC"),
    "watching_end_sec": (watching, "END_TIMEOUT_SEC"),
    "watching_quiet_ms": (watching, "QUIET_MS"),
    "lost_event_warning_sec": (service_introspection, "_WARN_EVERY_SEC"),
    "answer_sec": (local_broker, "ANSWER_TIMEOUT_SEC"),
    "log_lines_per_sec": (presence_log, "MAX_LINES_PER_SEC"),
    "probe_sec": (probe, "PROBE_TIMEOUT_SEC"),
    "mesh_heartbeat_sec": (member, "HEARTBEAT_SEC"),
    "unanswered_inspects": (inspections, "MAX_UNANSWERED"),
}


def set_limits(monkeypatch: pytest.MonkeyPatch, **values: Any) -> None:
    """Set limits by the names in `_HOMES`, for one test."""
    for name, value in values.items():
        monkeypatch.setattr(*_HOMES[name], value)


def be_patient(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let nodes and commands of this process wait for a broker while the machine pauses, for one test.

    Not for virtual time, which does not pause.
    """
    set_limits(
        monkeypatch,
        first_answer_sec=DEADLINE_SEC,
        connect_sec=DEADLINE_SEC,
        connect_node_sec=DEADLINE_SEC,
        answer_sec=DEADLINE_SEC,
    )
