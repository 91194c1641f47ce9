"""Removes terminal controls from the lines of programs.

The output has the lines of many programs: none of them may clear the screen, move the cursor or overwrite its
label. Colours stay.
"""

from __future__ import annotations

import re
from typing import Final

_CONTROLS: Final = bytes((*range(0x09), *range(0x0A, 0x20), 0x7F))
"""C0 controls except the tab."""
_C1_BEGIN: Final = b"\xc2"
"""The first byte of C1 controls, and of some letters, in UTF-8."""
_C1: Final = re.compile(rb"\xc2[\x80-\x9f]")
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
    """Return whether a text has terminal controls, including colours."""
    # `translate` is the fastest way to look at every byte; most lines have none.
    if len(text.translate(None, _CONTROLS)) != len(text):
        return True
    return _C1_BEGIN in text and _C1.search(text) is not None


def sanitize_line(line: bytes) -> bytes:
    """Remove all controls except colours; of a line that overwrites itself, keep the last state."""
    if not has_controls(_COLOR.sub(b"", line)):
        return line
    return _ALL_BUT_COLORS.sub(rb"\1", _last_state(line))


def plain_line(line: bytes) -> bytes:
    """Remove all controls, including colours."""
    return _ALL.sub(b"", _last_state(line)) if has_controls(line) else line


def _last_state(line: bytes) -> bytes:
    """Return the text after the last carriage return, except one at the end, as of progress bars."""
    return line.rstrip(b"\r").rpartition(b"\r")[2]
