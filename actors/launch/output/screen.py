"""The human-readable output: lines of processes with their labels, and messages of the launch."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.launch.description.process_actions import OutputMode
from actors.launch.output.messages import message_for
from actors.launch.output.sanitize import has_controls, sanitize_line
from actors.launch.planning.events import Level, ProcessIO, Stream
from actors.logging.terminal_text import LEVEL_COLORS, RESET, escape_controls

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.launch.planning.events import Event, Message

_LABEL_COLORS: Final = tuple(f"\x1b[{code}m" for code in (36, 35, 32, 94, 96, 95, 92))
"""Readable on light and dark backgrounds, and different from those of warnings and errors."""
_SHOWN: Final = frozenset({OutputMode.SCREEN, OutputMode.BOTH, OutputMode.FULL})


class Screen:
    """A listener that writes lines. It has no state, and may be called in any thread.

    Args:
        write: Called with whole lines; it must not block.
        color: Whether to colour labels, warnings and errors.
    """

    def __init__(self, write: Callable[[bytes], None], *, color: bool) -> None:
        self._write = write
        self._color = color

    def __call__(self, event: Event) -> None:
        """Show an event."""
        if isinstance(event, ProcessIO):
            if _is_shown(event):
                self._write(self._labelled(event))
        elif (message := message_for(event)) is not None:
            self._write(self._message_bytes(message))

    def _labelled(self, event: ProcessIO) -> bytes:
        label = f"{self._label(event.process_name)} ".encode(errors="backslashreplace")
        lines = event.lines
        if not has_controls(b"".join(lines)):
            return b"".join(label + line + b"\n" for line in lines)
        shown = map(sanitize_line, lines)
        # A line that leaves a colour on would colour all lines after it.
        return b"".join(label + line + (_RESET_LINE if b"\x1b" in line else b"\n") for line in shown)

    def _message_bytes(self, message: Message) -> bytes:
        level = message.level.value
        if self._color and message.level is not Level.INFO:
            begin, end = f"{LEVEL_COLORS[level]}[{level}] [{escape_controls(message.about)}]: ", f"{RESET}\n"
        else:
            begin, end = f"[{level}] {self._label(message.about)}: ", "\n"
        lines = escape_controls(message.text).split("\n")
        return "".join(f"{begin}{line}{end}" for line in lines).encode(errors="backslashreplace")

    def _label(self, name: str) -> str:
        label = f"[{escape_controls(name)}]"
        number = name.rpartition("-")[2]
        if not self._color or not number.isdecimal():
            return label
        return f"{_LABEL_COLORS[(int(number) - 1) % len(_LABEL_COLORS)]}{label}{RESET}"


_RESET_LINE: Final = f"{RESET}\n".encode()


def _is_shown(event: ProcessIO) -> bool:
    mode = event.process.output
    return mode in _SHOWN or (mode is OutputMode.LOG and event.stream is Stream.STDERR)
