"""SIGINT and SIGTERM end all contexts; then the handlers from before are called."""

from __future__ import annotations

import os
import signal
import threading
from enum import Enum
from typing import TYPE_CHECKING, Any, Final

from actors.ros.rclpy.context import initialized_contexts

if TYPE_CHECKING:
    from types import FrameType


class SignalHandlerOptions(Enum):
    """Which signals to handle."""

    NO = 0
    SIGINT = 1
    SIGTERM = 2
    ALL = 3


_previous: Final[dict[int, Any]] = {}
_options = SignalHandlerOptions.NO


def _handle(number: int, frame: FrameType | None) -> None:
    # This may interrupt any line of the program. It takes no lock and calls no user code: `end` only sets
    # flags, cancels waits, and wakes those that spin.
    for context in initialized_contexts():
        context.end()
    previous = _previous.get(number)
    # Python's own for SIGINT raises KeyboardInterrupt, as programs expect. SIGTERM's default is no
    # function, so that a program ends by leaving `spin`.
    if callable(previous):
        previous(number, frame)


def install_signal_handlers(options: SignalHandlerOptions = SignalHandlerOptions.ALL) -> None:
    """Handle signals, if this is the main thread: Python allows it nowhere else."""
    global _options  # noqa: PLW0603 - signals are the process's
    if options is SignalHandlerOptions.NO or threading.current_thread() is not threading.main_thread():
        return
    _options = options
    for number, wanted in (
        (signal.SIGINT, SignalHandlerOptions.SIGINT),
        (signal.SIGTERM, SignalHandlerOptions.SIGTERM),
    ):
        # Once for each number: a second `init` must not save this handler as the previous one, which would
        # call itself.
        if options in {wanted, SignalHandlerOptions.ALL} and number not in _previous:
            _previous[number] = signal.signal(number, _handle)


def uninstall_signal_handlers() -> None:
    """Restore the handlers from before, if this is the main thread."""
    global _options  # noqa: PLW0603 - signals are the process's
    if threading.current_thread() is not threading.main_thread():
        return
    _options = SignalHandlerOptions.NO
    while _previous:
        number, handler = _previous.popitem()
        # The program may have set a handler of its own since; that one stays.
        if signal.getsignal(number) is _handle:
            signal.signal(number, handler)


def get_current_signal_handlers_options() -> SignalHandlerOptions:
    """Return which signals are handled."""
    return _options


def _after_fork_in_child() -> None:
    """Restore the handlers from before in a child, which has no contexts yet."""
    uninstall_signal_handlers()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_after_fork_in_child)
