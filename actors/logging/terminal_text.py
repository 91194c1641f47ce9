"""Text for a terminal: log lines in ROS 2's format and colours, and control characters escaped."""

from __future__ import annotations

import re
from typing import Final

from proto.untrusted_text import escape

LEVEL_COLORS: Final = {"DEBUG": "\x1b[32m", "WARN": "\x1b[33m", "ERROR": "\x1b[31m", "FATAL": "\x1b[31m"}
RESET: Final = "\x1b[0m"
# Controls except line end and tab, characters that reverse the direction of text, and lone surrogates.
_CONTROLS = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u2028-\u202e\u2066-\u2069\ud800-\udfff]")


def escape_controls(text: str) -> str:
    """Escape the control characters of a string, except line ends and tabs.

    For log lines, which may have any printed text of their program: other unprintable characters, such as
    no-break spaces and joined emoji, stay. `proto.untrusted_text.sanitize` escapes these, too.
    """
    # Nearly every line: one test in C instead of a search.
    if text.isprintable():
        return text
    return _CONTROLS.sub(lambda match: match[0].encode("unicode_escape").decode(), text)


def log_line(label: str, stamp_ns: int, name: str, message: str, *, color: bool) -> str:
    """Return a log line in ROS 2's format: `[INFO] [1605120000.123456789] [talker]: text`.

    Control characters are escaped: all of them in the name, all but line ends and tabs in the message.

    Args:
        label: The name of the level.
        stamp_ns: When it was logged, in ns since the epoch.
        name: The logger's name.
        message: The text.
        color: Whether to colour the line by its level.
    """
    seconds, nanoseconds = divmod(stamp_ns, 1_000_000_000)
    text = f"[{label}] [{seconds}.{nanoseconds:09d}] [{escape(name)}]: {escape_controls(message)}"
    return in_color(text, label) if color else text


def in_color(text: str, label: str) -> str:
    """Return a text in the colour of a level, if that has one."""
    return f"{LEVEL_COLORS[label]}{text}{RESET}" if label in LEVEL_COLORS else text
