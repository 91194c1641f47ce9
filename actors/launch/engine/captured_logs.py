"""The log of the launch's process: what its nodes say is theirs, the rest is the launch's own."""

from __future__ import annotations

import asyncio
import logging
import threading
from abc import abstractmethod
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING

from actors.launch.engine.captured_output import CapturedOutput
from actors.launch.planning.events import Level, Message, Stream
from actors.logging.logger import ROOT_NAME
from actors.logging.output import RosFormatter
from proto.errors import escape

if TYPE_CHECKING:
    from collections.abc import Generator

    from actors.launch.planning.events import Listener


@contextmanager
def captured_logs() -> Generator[None]:
    """Meanwhile make lines on stderr of what nodes in this process log, as scripts do."""
    with _added(_CapturedLogs()):
        yield


@contextmanager
def own_logs(tell: Listener) -> Generator[None]:
    """Meanwhile make messages of what others log in this process. They are told in the loop."""
    with _added(_OwnLogs(tell)):
        yield


class _Teller(logging.Handler):
    """A handler whose own mistakes, and those in a call, are reported as logging does it."""

    def emit(self, record: logging.LogRecord) -> None:
        try:
            self.take(record)
        except Exception:  # noqa: BLE001 - whoever logs must not fail for it
            self.handleError(record)

    @abstractmethod
    def take(self, record: logging.LogRecord) -> None: ...


class _CapturedLogs(_Teller):
    def __init__(self) -> None:
        super().__init__()
        self._plain, self._colored = RosFormatter(), RosFormatter(color=True)

    def take(self, record: logging.LogRecord) -> None:
        captured = CapturedOutput.current()
        if captured is not None:
            line = (self._colored if captured.colored else self._plain).format(record)
            captured.write(Stream.STDERR, f"{line}\n".encode(errors="backslashreplace"))


class _OwnLogs(_Teller):
    def __init__(self, tell: Listener) -> None:
        super().__init__()
        self._tell = tell
        self._loop = asyncio.get_running_loop()
        self._thread = threading.get_ident()

    def take(self, record: logging.LogRecord) -> None:
        if CapturedOutput.current() is not None:
            return
        message = _message(record)
        if threading.get_ident() == self._thread:
            self._tell(message)
        else:
            with suppress(RuntimeError):  # the loop has been closed
                self._loop.call_soon_threadsafe(self._tell, message)


@contextmanager
def _added(handler: logging.Handler) -> Generator[None]:
    root = logging.getLogger()
    root.addHandler(handler)
    try:
        yield
    finally:
        root.removeHandler(handler)


def _message(record: logging.LogRecord) -> Message:
    level = Level.INFO
    if record.levelno >= logging.WARNING:
        level = Level.ERROR if record.levelno >= logging.ERROR else Level.WARN
    return Message(level, escape(record.getMessage()), record.name.removeprefix(f"{ROOT_NAME}."))
