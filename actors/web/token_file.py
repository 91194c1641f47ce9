"""A token for the web server from a file."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Final

from proto.errors import CallboardError

TOKEN: Final = re.compile(r"[\w-]{16,}", re.ASCII)
"""Valid tokens: they need no escapes in an address, and a random one cannot be guessed."""


class TokenFileError(CallboardError):
    """The file has no token. Write one into it: 16 or more letters, digits, `-` or `_`."""


def read_token(path: str | Path) -> str:
    """Return the token in a file.

    Args:
        path: The file; blanks around the token are ignored.

    Raises:
        TokenFileError: The file cannot be read, or has no valid token.
    """
    try:
        token = Path(path).read_text(encoding="utf-8").strip()
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "it is not text"
        raise TokenFileError(f"Cannot read the token in {path}: {reason}") from None
    if TOKEN.fullmatch(token) is None:
        raise TokenFileError(f"{path} needs a token: 16 or more letters, digits, '-' or '_'")
    return token
