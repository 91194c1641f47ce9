"""Unattributed output: what handlers and libraries print in the launch's process, but none of its nodes.

It goes where the launch's lines go, which never wait: whoever prints holds the loop.
"""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING

from actors.launch.engine.lines import Lines

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from actors.launch.planning.events import Stream


class UnattributedOutput:
    """Makes whole lines of it. For all threads.

    Args:
        writers: Where to, by stream. They return at once.
    """

    def __init__(self, writers: Mapping[Stream, Callable[[bytes], None]]) -> None:
        self._writers = writers
        self._lines = {stream: Lines() for stream in writers}
        # A destructor may print while something is being printed.
        self._lock = threading.RLock()

    def write(self, stream: Stream, data: bytes) -> None:
        """Take something; a line is passed on when it is whole."""
        with self._lock:
            self._pass_on(stream, self._lines[stream].feed(data))

    def end(self) -> None:
        """Pass on lines without an end."""
        with self._lock:
            for stream, lines in self._lines.items():
                self._pass_on(stream, lines.end())

    def _pass_on(self, stream: Stream, lines: list[bytes]) -> None:
        if lines:
            self._writers[stream](b"".join(line + b"\n" for line in lines))
