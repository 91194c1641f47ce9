"""Text for a terminal: the colours of log levels, and control characters escaped."""

from __future__ import annotations

import re
from typing import Final

LEVEL_COLORS: Final = {"DEBUG": "\x1b[32m", "WARN": "\x1b[33m", "ERROR": "\x1b[31m", "FATAL": "\x1b[31m"}
RESET: Final = "\x1b[0m"
# Controls except line end and tab, characters that reverse the direction of text, and lone surrogates.
_CONTROLS = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u2028-\u202e\u2066-\u2069\ud800-\udfff]")


def escape_controls(text: str) -> str:
    """Escape the control characters of a text, except line ends and tabs.

    For log lines, which may have any printed text of their program: other unprintable characters, such as
    no-break spaces and joined emoji, stay. The CLI's `sanitize` escapes these, too.
    """
    if text.isprintable():
        return text
    return _CONTROLS.sub(lambda match: match[0].encode("unicode_escape").decode(), text)
