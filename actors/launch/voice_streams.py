"""sys.stdout and sys.stderr of the launch's process: what its nodes print is theirs, the rest goes on."""

from __future__ import annotations

import io
import sys
from contextlib import contextmanager
from typing import TYPE_CHECKING

from actors.launch.events import Stream
from actors.launch.voice import Voice

if TYPE_CHECKING:
    from collections.abc import Callable, Generator
    from typing import TextIO

    from _typeshed import ReadableBuffer


class _VoiceStream(io.RawIOBase):
    """Gives bytes to the voice of the node that runs now; without one to whoever takes asides."""

    def __init__(self, stream: Stream, beyond: TextIO, aside: Callable[[Stream, bytes], None] | None) -> None:
        super().__init__()
        self._stream = stream
        self._beyond = beyond
        self._aside = aside

    def writable(self) -> bool:
        return True

    def isatty(self) -> bool:
        return Voice.here() is None and self._beyond.isatty()

    def fileno(self) -> int:
        return self._beyond.fileno()

    def write(self, data: ReadableBuffer, /) -> int:
        content = bytes(data)
        voice = Voice.here()
        if voice is not None:
            voice.write(self._stream, content)
        elif self._aside is not None:
            self._aside(self._stream, content)
        else:
            self._beyond.write(content.decode(errors="backslashreplace"))
            self._beyond.flush()
        return len(content)


@contextmanager
def voice_streams(aside: Callable[[Stream, bytes], None] | None = None) -> Generator[None]:
    """Have such streams meanwhile. They hold for the whole process.

    Args:
        aside: Takes what others print, from any thread, and must not wait; None: the streams before.
    """
    before = sys.stdout, sys.stderr
    sys.stdout = _text(Stream.STDOUT, before[0], aside)
    sys.stderr = _text(Stream.STDERR, before[1], aside)
    try:
        yield
    finally:
        sys.stdout, sys.stderr = before


def _text(stream: Stream, beyond: TextIO, aside: Callable[[Stream, bytes], None] | None) -> TextIO:
    raw = _VoiceStream(stream, beyond, aside)
    # Unbuffered, so that a text is written in the context of whoever prints it.
    return io.TextIOWrapper(raw, encoding="utf-8", errors="backslashreplace", newline="", write_through=True)  # type: ignore[type-var]
