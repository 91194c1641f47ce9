"""Watches a program's event loop from a thread: names the line that blocks it, and lets signals end it.

A loop handles signals between two callbacks, so a callback that does not return would never hear of them.
While the loop is blocked, the second signal raises KeyboardInterrupt in the callback. A single SIGTERM does
so shortly before `stop_timeout_sec` is over, and ends the process after it if that does not help either.
Nothing is measured per callback: once a second the thread looks at what the loop's thread executes, and only
if that is not the loop itself, it asks the loop to answer.
"""

from __future__ import annotations

import asyncio
import math
import os
import signal
import sys
import threading
import time
import traceback
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from actors.logging.logger import get_logger
from actors.node.node_runner import GRACE_SEC, longest_stop_sec

if TYPE_CHECKING:
    from collections.abc import Callable, Generator
    from types import FrameType

BLOCKED_SEC: Final = 1.0
"""Seconds without an answer of the loop after which the line that blocks it is named."""

QUIET_SEC: Final = 10.0
"""Seconds between two such reports."""

STOPPING_SEC: Final = 0.1
"""Seconds between two looks while a signal waits for the loop."""

TOGETHER_SEC: Final = 0.25
"""Signals within this time are one: a terminal and a parent may both send it."""

STOP_SIGNALS: Final = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM") if hasattr(signal, name))

_LOOP: Final = ("asyncio", "uvloop", "selectors")
"""The modules of loops. Callbacks are above them on the stack."""
_DEBUGGERS: Final = ("pdb", "bdb")
_LIBRARIES: Final = (*_LOOP, "actors", "proto", "callboard")
_STANDARD_LIBRARY: Final = str(Path(os.__file__).parent) + os.sep


class LoopWatch:
    """Watches the loop of the main thread.

    Args:
        loop: The loop, which runs in this thread. Its handlers of signals are installed.
        warn: Called with the text of a warning, in a thread of its own; it must not need the loop.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop, warn: Callable[[str], object]) -> None:
        self._loop = loop
        self._warn = warn
        self._main = threading.get_ident()
        self._process = os.getpid()
        self._handlers: dict[int, Any] = {}
        self._pending: list[tuple[int, float]] = []
        """The signals that the loop has not handled, and when they arrived."""
        self._forced_at: float | None = None
        """When the callback was interrupted because of them."""
        self._interrupted = ""
        """Where it was then."""
        self._forcing = self._ended = self._answered = False
        self._quiet_until = 0.0
        # Not an Event: its lock would be taken twice if a signal interrupted `set`.
        self._wake = threading.Lock()
        self._wake.acquire()
        self._thread = threading.Thread(target=self._run, name="callboard loop watch", daemon=True)

    def begin(self) -> None:
        """Begin to watch, and to interrupt callbacks."""
        for number in STOP_SIGNALS:
            self._handlers[number] = signal.getsignal(number)
            signal.signal(number, self._on_signal)
        self._thread.start()

    def end(self) -> None:
        """Stop watching, restore the handlers from before, and log what was interrupted."""
        self._ended = True
        self._wake_thread()
        self._thread.join()  # it never waits for anything else
        for number, handler in self._handlers.items():
            if signal.getsignal(number) == self._on_signal:
                signal.signal(number, handler)
        if self._interrupted:
            get_logger("callboard").fatal(
                f"Interrupted a callback that did not return, at {self._interrupted}"
            )

    def _wake_thread(self) -> None:
        with suppress(RuntimeError):  # it is awake
            self._wake.release()

    # In the main thread, between any two instructions

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        handler = self._handlers[number]
        if callable(handler) and not self._forcing:
            handler(number, frame)  # the loop's: it will handle the signal when it runs
        if os.getpid() != self._process:  # a forked child, without the loop and the thread
            return
        now = time.monotonic()
        self._pending.append((number, now))
        with suppress(RuntimeError):  # it has closed
            self._loop.call_soon_threadsafe(self._pending.clear)
        self._wake_thread()
        late = len(self._pending) > 1 and now - self._pending[0][1] >= TOGETHER_SEC
        if self._forcing or (late and _in_program(frame)):
            self._forcing = False
            self._forced_at = self._forced_at or now
            self._interrupted = _where(frame)
            raise KeyboardInterrupt

    # In the thread

    def _run(self) -> None:
        # The kernel gives a signal to any thread. If this one took it, the main thread would sleep on.
        if hasattr(signal, "pthread_sigmask"):
            signal.pthread_sigmask(signal.SIG_BLOCK, STOP_SIGNALS)
        answer_due: float | None = None
        while not self._ended:
            pause = STOPPING_SEC if self._pending else BLOCKED_SEC
            began = time.monotonic()
            self._wake.acquire(timeout=pause)
            now = time.monotonic()
            if now - began > pause + BLOCKED_SEC / 2:
                answer_due = None  # the process was suspended, or the machine has no time for anybody
            if answer_due is None or self._answered:
                answer_due = now + BLOCKED_SEC if self._ask() else None
            elif now >= answer_due and now >= self._quiet_until:
                self._quiet_until = now + QUIET_SEC
                self._report(_where(_frame_of(self._main)))
            self._end_callback(now)

    def _report(self, where: str) -> None:
        text = (
            f"A callback has held the event loop for more than {BLOCKED_SEC:g} s; nothing else on it runs."
            f" Long work belongs in a thread: await asyncio.to_thread(...). It is at {where}"
        )
        if where:  # in a thread of its own: the callback may hold a lock of logging
            threading.Thread(target=self._warn, args=(text,), daemon=True).start()

    def _ask(self) -> bool:
        """Ask the loop to answer, unless it waits for events; return whether it was asked."""
        self._answered = False
        frame = _frame_of(self._main)
        if frame is None or not _in_callback(frame):
            return False
        try:
            self._loop.call_soon_threadsafe(self._answer)
        except RuntimeError:  # it has closed
            return False
        return True

    def _answer(self) -> None:
        self._answered = True

    def _end_callback(self, now: float) -> None:
        """Interrupt the callback if it is time for it, or end the process if that has not helped."""
        pending, limit = list(self._pending), longest_stop_sec()
        if not pending or self._ended:
            self._forced_at = None
            return
        asked_at = next((at for number, at in pending if number != signal.SIGINT), math.inf)
        twice_at = pending[0][1] + BLOCKED_SEC if len(pending) > 1 else math.inf
        if self._forced_at is None:
            if now >= min(twice_at, asked_at + limit - min(GRACE_SEC, limit / 2)):
                self._forcing = True
                _signal_thread(self._main, pending[-1][0])
        elif now >= min(asked_at, self._forced_at) + limit:
            _end_process(pending[-1][0], _where(_frame_of(self._main)))


def _signal_thread(thread: int, number: int) -> None:
    """Interrupt a thread, which an exception set from here would not do while it waits for the kernel."""
    if hasattr(signal, "pthread_kill"):
        signal.pthread_kill(thread, number)
    else:  # Windows
        signal.raise_signal(number)


def _frame_of(thread: int) -> FrameType | None:
    """Return the innermost frame of a thread."""
    # Its documentation names this very use.
    return sys._current_frames().get(thread)  # noqa: SLF001 # pyright: ignore[reportPrivateUsage]


def _stack(frame: FrameType | None) -> list[FrameType]:
    """Return the frames above the runner of the loop, the innermost first."""
    frames: list[FrameType] = []
    while frame is not None and frame.f_globals.get("__name__") != "asyncio.runners":
        frames.append(frame)
        frame = frame.f_back
    return frames


def _module(frame: FrameType) -> str:
    name: str = frame.f_globals.get("__name__", "")
    return name.partition(".")[0]


def _in_callback(frame: FrameType) -> bool:
    modules = {_module(each) for each in _stack(frame)}
    return bool(modules.difference(_LOOP)) and modules.isdisjoint(_DEBUGGERS)


def _in_program(frame: FrameType | None) -> bool:
    return any(_module(each) not in _LIBRARIES for each in _stack(frame))


def _where(frame: FrameType | None) -> str:
    """Return the program's line that is executed in a frame, and its stack; "" in the loop itself."""
    frames = _stack(frame)
    if not frames:
        return ""
    own = [each for each in frames if _module(each) not in _LIBRARIES and not _is_standard(each)]
    found = own[0] if own else frames[0]
    if own:
        frames = frames[: frames.index(own[-1]) + 1]  # how callboard came to call it helps nobody
    stack = traceback.StackSummary.extract(((each, each.f_lineno) for each in reversed(frames)), limit=-20)
    line = f"{found.f_code.co_filename}:{found.f_lineno}, in {found.f_code.co_qualname}"
    return f"{line}\n{''.join(stack.format()).rstrip()}"


def _is_standard(frame: FrameType) -> bool:
    file = frame.f_code.co_filename
    return file.startswith((_STANDARD_LIBRARY, "<frozen")) and "site-packages" not in file


def _end_process(number: int, where: str) -> None:
    """End the process."""
    text = f"Ending at once, because a callback does not end although it was interrupted. It is at {where}\n"
    # Not by logging, whose locks the callback may hold; in a thread, because nobody may read stderr.
    writer = threading.Thread(target=os.write, args=(2, text.encode()), daemon=True)
    writer.start()
    writer.join(GRACE_SEC)
    os._exit(128 + number)


@contextmanager
def watch_loop(warn: Callable[[str], object] | None = None) -> Generator[None]:
    """Watch the running loop, if it is the main thread's.

    Args:
        warn: As for `LoopWatch`; None logs.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    watch = LoopWatch(asyncio.get_running_loop(), warn or get_logger("callboard").warning)
    watch.begin()
    try:
        yield
    finally:
        watch.end()
