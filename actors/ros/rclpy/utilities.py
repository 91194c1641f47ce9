"""The default context, and whether it runs."""

from __future__ import annotations

import os
import sys
import threading
from typing import TYPE_CHECKING, Final

from actors.arguments.ros_arguments import parse_ros_arguments
from actors.ros.rclpy._rclpy_pybind11 import rclpy_get_rmw_implementation_identifier
from actors.ros.rclpy.context import Context
from actors.ros.rclpy.imported_names import imported_names

if TYPE_CHECKING:
    from collections.abc import Sequence

_lock: Final = threading.RLock()
_default: Context | None = None

__getattr__ = imported_names(__name__, "S_TO_NS")


def get_default_context(*, shutting_down: bool = False) -> Context:
    """Return the default context; with `shutting_down` the next call makes a new one."""
    global _default  # noqa: PLW0603 - rclpy's: the one of programs that name none
    context = _default
    if context is not None and not shutting_down:  # without the lock, which a signal handler may interrupt
        return context
    with _lock:
        context = _default or Context()
        # rclpy makes a new default context after a shutdown, so that a program (or a test) may call `init`
        # again.
        _default = None if shutting_down else context
    return context


def _after_fork_in_child() -> None:
    """Let the next call make a new one: the parent's refuses all use. It takes no lock."""
    global _default  # noqa: PLW0603 - see above
    _default = None


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_after_fork_in_child)


def ok(*, context: Context | None = None) -> bool:
    """Return whether a context has been initialized and not shut down; None: the default one."""
    return (context or get_default_context()).ok()


def shutdown(*, context: Context | None = None) -> None:
    """Shut a context down; None: the default one."""
    (context or get_default_context(shutting_down=True)).shutdown()


def try_shutdown(*, context: Context | None = None) -> None:
    """Shut a context down unless that has been done; None: the default one."""
    if context is None:
        context = get_default_context()
        # One that was never initialized stays the default: there is nothing to replace.
        if context.handle is not None:  # also after a signal, when it is no longer ok
            get_default_context(shutting_down=True)
    context.try_shutdown()


def remove_ros_args(args: Sequence[str] | None = None) -> list[str]:
    """Return the arguments that are not ROS's; None: those of the process."""
    given = sys.argv if args is None else args
    return list(parse_ros_arguments(given).remaining)


get_rmw_implementation_identifier = rclpy_get_rmw_implementation_identifier


def get_available_rmw_implementations() -> set[str]:
    """Return what could carry messages."""
    return {"callboard"}


def timeout_sec_to_nsec(timeout_sec: float | None) -> int:
    """Return seconds as nanoseconds; -1 for None and for negative numbers, which mean no limit."""
    return -1 if timeout_sec is None or timeout_sec < 0 else int(timeout_sec * 1e9)
