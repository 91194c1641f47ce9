"""What goes to stdout: lines that cannot steer a terminal, and JSON."""

from __future__ import annotations

import json
import math
import sys
from typing import Any, Final, cast

QUOTED_CHARS: Final = 500
"""What an error quotes of its input, at most."""


def harmless(text: str) -> str:
    """Escape what is not printable but for line ends and tabs: a message may come from a stranger."""
    if text.replace("\n", "").replace("\t", "").isprintable():
        return text
    return "".join(
        char if char in "\n\t" or char.isprintable() else char.encode("unicode_escape").decode()
        for char in text
    )


def shortened(text: str) -> str:
    """Return foreign text for an error in one line: of a long one the beginning, and how long it is."""
    line = " ".join(text[: 2 * QUOTED_CHARS].split())
    if len(text) <= QUOTED_CHARS:
        return line
    return f"{line[:QUOTED_CHARS]}... ({len(text)} characters)"


def say(text: str) -> None:
    """Print a line, or several."""
    print(harmless(text))


def note(text: str) -> None:
    """Print a line to stderr, for people."""
    print(harmless(text), file=sys.stderr, flush=True)


def say_json(value: object) -> None:
    """Print one JSON document in one line. JSON has no NaN and no infinity: they become null."""
    try:
        text = json.dumps(value, allow_nan=False)
    except ValueError:
        text = json.dumps(_finite(value), allow_nan=False)
    print(text)


def _finite(value: Any) -> Any:
    if isinstance(value, float) and not math.isfinite(value):
        return None
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in cast("Any", value).items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in cast("list[Any]", value)]
    return value
