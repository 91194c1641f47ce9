"""Text from elsewhere, made safe for a terminal, a log, a file or an exception.

There are three policies:

- `escape`: a name or word that is quoted in a line of ours; each character takes one column.
- `peer_text`: a whole text of a peer, in one line, and cut.
- `sanitize`: several lines that are printed as they are, such as a message.

Texts of programs on this machine have other rules: `actors.logging.terminal_text` lets through whatever a
log line may contain, and `actors.launch.output.sanitize` removes what would steer the terminal.
"""

from __future__ import annotations

import unicodedata

from proto.limits import MAX_ERROR_TEXT


def escape(text: str) -> str:
    """Escape text from elsewhere for a terminal or a log.

    Args:
        text: Any text.

    Returns:
        The text with control characters, line ends, and invisible, combining and double-width characters as
        Python escapes, so that each character takes one column.
    """
    if text.isascii() and text.isprintable():
        return text
    return "".join(char if _is_plain(char) else char.encode("unicode_escape").decode() for char in text)


def peer_text(text: str) -> str:
    """Return a peer's text for a log, a terminal, a file or an exception: in one line, and not too long.

    Args:
        text: The text of an ERROR, GOODBYE, REFUSED or NOTICE frame, or of an error in a reply.

    Returns:
        The text with control characters, line ends and invisible characters as Python escapes, cut at 500
        characters. Letters of any language stay.
    """
    if len(text) <= MAX_ERROR_TEXT and text.isprintable():
        return text
    text = text[: MAX_ERROR_TEXT + 1]
    if not text.isprintable():
        text = "".join(
            char if char.isprintable() else char.encode("unicode_escape").decode() for char in text
        )
    return text if len(text) <= MAX_ERROR_TEXT else f"{text[: MAX_ERROR_TEXT - 1]}…"


def peer_name(name: str) -> str:
    """Return a name that a peer has sent, with `peer_text`'s escapes if no broker would accept it."""
    return name if name.isprintable() else peer_text(name)


def sanitize(text: str) -> str:
    """Escape unprintable characters except newlines and tabs: messages are untrusted.

    Invisible and private characters are escaped, too, so that two names or texts that differ look different.
    """
    if text.replace("\n", "").replace("\t", "").isprintable():
        return text
    return "".join(
        char if char in "\n\t" or char.isprintable() else char.encode("unicode_escape").decode()
        for char in text
    )


def _is_plain(char: str) -> bool:
    if not char.isprintable() or unicodedata.category(char).startswith("M"):
        return False
    return unicodedata.east_asian_width(char) not in {"W", "F"}
