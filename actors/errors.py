"""Errors of nodes, clients and supervisors.

    CallboardError (proto.errors)
    ├── BrokerUnreachable (ConnectionError)     no broker answered in time, or the link broke
    │   └── TlsFailed                           no TLS session with the broker; `fault` says why
    ├── ProtocolError (proto.errors)
    │   └── NotAuthorized                       the broker requires other credentials, or they must not leave
    ├── NodeNameTaken                           another live node has this full name, unshared
    ├── NodeDestroyed (RuntimeError)            the node or entity has been destroyed
    ├── NodeAlreadyRunningError (RuntimeError)  a node runs once at a time
    ├── PublisherRefused                        the broker refuses this publisher
    ├── PublisherFull                           a KEEP_ALL publisher's readers are too slow; wait for ready()
    ├── TimeSourceChanged (RuntimeError)        simulated time was switched on or off during a sleep
    ├── WaitTimeout (TimeoutError)              a wait or a call from another thread did not finish in time
    ├── CallCancelled                           a call from another thread was cancelled in the loop
    ├── SupervisorGaveUp                        a child has died too often
    ├── GoalRejected                            an action server has rejected the goal
    ├── InvalidGoalTransitionError (RuntimeError)  a goal cannot go from its state into this one
    └── CallFailed                              a call ended without a reply:
        ├── ServiceUnavailable                  no server, no connection, or it broke before the reply
        │   └── ServiceOverloaded               a limit on waiting calls is reached
        ├── ServiceTimeout (TimeoutError)       the deadline passed
        ├── GoalUnknown                         the action server does not know the goal, or no longer
        └── RemoteError                         the handler raised

A condition of the running system has no suffix: a program handles it. A mistake of the program or of its
input ends in Error: somebody corrects it. docs/reference/errors.md lists all, and the exceptions to the rule.

Other errors are in the packages that raise them: actors/interfaces/errors.py, actors/parameters/errors.py,
actors/arguments/ros_arguments.py, and proto/errors.py for names and URLs.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from proto.errors import CallboardError, ErrorCode, ProtocolError

if TYPE_CHECKING:
    from proto.wire.tls import TlsFault


class BrokerUnreachable(CallboardError, ConnectionError):
    """No broker answered in time, or the link to it broke."""

    is_operational = True


class TlsFailed(BrokerUnreachable):
    """There is no TLS session with the broker; the text says why, and what to do.

    Attributes:
        fault: The reason.
    """

    def __init__(self, fault: TlsFault, text: str) -> None:
        super().__init__(text)
        self.fault = fault


class NotAuthorized(ProtocolError):
    """The broker requires other credentials, or the token must not be sent to it."""

    def __init__(self, text: str) -> None:
        super().__init__(ErrorCode.UNAUTHORIZED, text)


class TimeSourceChanged(CallboardError, RuntimeError):
    """Simulated time was switched on or off during a sleep, which so has no defined end."""


class NodeNameTaken(CallboardError):
    """Another live node has this full name, and not both share it."""

    is_operational = True


class NodeDestroyed(CallboardError, RuntimeError):
    """The node or entity has been destroyed."""


class NodeAlreadyRunningError(CallboardError, RuntimeError):
    """A node runs once at a time."""


class PublisherRefused(CallboardError):
    """The broker refuses this publisher; none of its messages is sent in this session."""


class PublisherFull(CallboardError):
    """The queue of a KEEP_ALL publisher is full; this message was not queued."""


class WaitTimeout(CallboardError, TimeoutError):
    """A condition did not become true in time."""


class CallCancelled(CallboardError):
    """The coroutine that another thread calls was cancelled in its loop, not by that thread."""


class SupervisorGaveUp(CallboardError):
    """A child died too often, and its supervisor has stopped all children.

    Attributes:
        supervisor: The supervisor's name.
        child: The name of the child that died last.
        reason: Why it died: "exit code 1", "killed by SIGKILL", "ValueError: no such map".
    """

    # The supervisor has logged each death, with the traceback of an error.
    is_operational = True

    def __init__(self, supervisor: str, child: str, reason: str) -> None:
        super().__init__(supervisor, child, reason)
        self.supervisor = supervisor
        self.child = child
        self.reason = reason

    def __str__(self) -> str:
        return f"Supervisor '{self.supervisor}' gave up: '{self.child}' died too often, last: {self.reason}"


class GoalRejected(CallboardError):
    """The action server has rejected the goal: it has no result, no feedback, and cannot be cancelled."""


class InvalidGoalTransitionError(CallboardError, RuntimeError):
    """A goal cannot go from its state into this one; for example, an ended goal cannot succeed."""


class CallFailed(CallboardError):
    """A call ended without a reply; base of all such errors."""


class ServiceUnavailable(CallFailed):
    """No server, no connection to a broker, or it broke before the reply arrived."""


class ServiceOverloaded(ServiceUnavailable):
    """Too many calls wait: of this client, of its link, or at the server. The handler did not run."""


class ServiceTimeout(CallFailed, TimeoutError):
    """The deadline passed; the server's handler is cancelled."""


class GoalUnknown(CallFailed):
    """The action server does not know the goal: its result has expired, or the server has been restarted."""


class RemoteError(CallFailed):
    """The server did not give a valid reply.

    Attributes:
        type_name: The exception's type in the server ("ZeroDivisionError").
        text: The exception's text.
        service: The full name of the service.
    """

    def __init__(self, type_name: str, text: str, service: str = "") -> None:
        super().__init__(type_name, text, service)
        self.type_name = type_name
        self.text = text
        self.service = service

    def __str__(self) -> str:
        text = f"{self.type_name}: {self.text}"
        return f"Service '{self.service}' failed: {text}" if self.service else text


def error_text(error: BaseException) -> str:
    """Return the text of an exception as valid UTF-8, even if its `__str__` raises."""
    try:
        text = str(error)
    except Exception:  # noqa: BLE001 - the user's exception; its own text must not hide it
        return "(an exception without a readable text)"
    return text.encode("utf-8", "backslashreplace").decode()
