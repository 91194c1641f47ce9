"""Output of commands: lines without terminal escapes, and JSON."""

from __future__ import annotations

import json
import math
import sys
from typing import TYPE_CHECKING, Any, Final, cast

from proto.untrusted_text import sanitize

if TYPE_CHECKING:
    from collections.abc import Iterable

QUOTED_CHARS: Final = 500
"""Limit on the characters of its input that an error quotes."""


def shortened(text: str) -> str:
    """Return untrusted text in one line for an error; a long one is cut, and its length added."""
    line = " ".join(text[: 2 * QUOTED_CHARS].split())
    if len(text) <= QUOTED_CHARS:
        return line
    return f"{line[:QUOTED_CHARS]}... ({len(text)} characters)"


def print_out(text: str) -> None:
    """Print one or more lines."""
    print(sanitize(text))


def print_err(text: str) -> None:
    """Print a line to stderr."""
    print(sanitize(text), file=sys.stderr, flush=True)


def print_warning(text: str) -> None:
    """Print a warning to stderr, as ROS 2 marks it."""
    print_err(f"WARNING: {text}")


def print_json(value: object) -> None:
    """Print one JSON document in one line.

    JSON has no NaN and no infinity: they become the texts "nan", "inf" and "-inf", which verbs read as
    numbers where the type has numbers.
    """
    try:
        text = json.dumps(value, allow_nan=False)
    except ValueError:
        text = json.dumps(_finite(value), allow_nan=False)
    print(text)


def print_names(names: Iterable[str], *, json: bool = False) -> None:
    """Print names, one a line, or as one JSON array."""
    if json:
        print_json(list(names))
        return
    for name in names:
        print_out(name.replace("\n", "\\n"))


def _finite(value: Any) -> Any:
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in cast("Any", value).items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in cast("list[Any]", value)]
    return value
