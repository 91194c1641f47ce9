"""sys.stdout and sys.stderr of the launch's process: what its nodes print is theirs, the rest goes on."""

from __future__ import annotations

import io
import sys
from contextlib import contextmanager
from typing import TYPE_CHECKING

from actors.launch.engine.captured_output import CapturedOutput
from actors.launch.planning.events import Stream

if TYPE_CHECKING:
    from collections.abc import Callable, Generator
    from typing import TextIO

    from _typeshed import ReadableBuffer


class _CapturedStream(io.RawIOBase):
    """Passes bytes on as output of the node that runs now, or as unattributed output."""

    def __init__(
        self, stream: Stream, beyond: TextIO, unattributed: Callable[[Stream, bytes], None] | None
    ) -> None:
        super().__init__()
        self._stream = stream
        self._beyond = beyond
        self._unattributed = unattributed

    def writable(self) -> bool:
        return True

    def isatty(self) -> bool:
        return CapturedOutput.current() is None and self._beyond.isatty()

    def fileno(self) -> int:
        return self._beyond.fileno()

    def write(self, data: ReadableBuffer, /) -> int:
        content = bytes(data)
        captured = CapturedOutput.current()
        if captured is not None:
            captured.write(self._stream, content)
        elif self._unattributed is not None:
            self._unattributed(self._stream, content)
        else:
            self._beyond.write(content.decode(errors="backslashreplace"))
            self._beyond.flush()
        return len(content)


@contextmanager
def captured_streams(unattributed: Callable[[Stream, bytes], None] | None = None) -> Generator[None]:
    """Have such streams meanwhile. They hold for the whole process.

    Args:
        unattributed: Takes what others print, from any thread, and must not wait; None: the streams before.
    """
    before = sys.stdout, sys.stderr
    sys.stdout = _text(Stream.STDOUT, before[0], unattributed)
    sys.stderr = _text(Stream.STDERR, before[1], unattributed)
    try:
        yield
    finally:
        sys.stdout, sys.stderr = before


def _text(stream: Stream, beyond: TextIO, unattributed: Callable[[Stream, bytes], None] | None) -> TextIO:
    raw = _CapturedStream(stream, beyond, unattributed)
    # Unbuffered, so that a text is written in the context of whoever prints it.
    return io.TextIOWrapper(raw, encoding="utf-8", errors="backslashreplace", newline="", write_through=True)  # type: ignore[type-var]
