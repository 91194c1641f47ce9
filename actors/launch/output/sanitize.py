"""Sanitize the lines of programs: take out what would control the terminal that shows them.

The output has the lines of many programs: none of them may clear the screen, move the cursor or write
over its label. Colours may stay. A line with nothing to take out costs a look.
"""

from __future__ import annotations

import re
from typing import Final

_CONTROLS: Final = bytes((*range(0x09), *range(0x0A, 0x20), 0x7F))
"""All but the tab."""
_NEWER_BEGIN: Final = b"\xc2"
"""Of the newer controls, and of some letters, in UTF-8."""
_NEWER: Final = re.compile(rb"\xc2[\x80-\x9f]")
_COLORS: Final = rb"\x1b\[[0-9;:]*m"
_SEQUENCES: Final = (
    rb"(?:\x1b\[|\xc2\x9b)[0-?]*[ -/]*[@-~]"
    rb"|(?:\x1b[\]PX^_]|\xc2[\x90\x98\x9d-\x9f])[^\x07\x1b]*(?:\x07|\x1b\\)?"  # titles and other texts
    rb"|\x1b[ -/]*[0-~]"
    rb"|[\x00-\x08\x0a-\x1f\x7f]|\xc2[\x80-\x9f]"
)
_COLOR: Final = re.compile(_COLORS)
_ALL: Final = re.compile(_SEQUENCES)
_ALL_BUT_COLORS: Final = re.compile(rb"(" + _COLORS + rb")|" + _SEQUENCES)


def has_controls(text: bytes) -> bool:
    """Tell whether a text may have anything in it that has_controls a terminal, colours among it."""
    if len(text.translate(None, _CONTROLS)) != len(text):
        return True
    return _NEWER_BEGIN in text and _NEWER.search(text) is not None


def sanitize_line(line: bytes) -> bytes:
    """Return a line as it may be shown: with its colours, and of what overwrites itself, the last state."""
    if not has_controls(_COLOR.sub(b"", line)):  # the common case is quick
        return line
    return _ALL_BUT_COLORS.sub(rb"\1", _last_state(line))


def plain_line(line: bytes) -> bytes:
    """Return a line without colours, too."""
    return _ALL.sub(b"", _last_state(line)) if has_controls(line) else line


def _last_state(line: bytes) -> bytes:
    """Return what is behind the last carriage return, or before it at the end: progress bars use it so."""
    return line.rstrip(b"\r").rpartition(b"\r")[2]
