"""Numbers in YAML files that know how they are written.

Where an option is a string, `default: 1.10` is the string "1.10", and `1e3` and `010` are no other strings
either. Only what the option is decides about it, and that is known later.
"""

from __future__ import annotations


class WrittenInt(int):
    """An integer.

    Attributes:
        written: The text in the file.
    """

    written: str


class WrittenFloat(float):
    """A number that is no integer.

    Attributes:
        written: The text in the file.
    """

    written: str


def written_number(value: float, text: str) -> WrittenInt | WrittenFloat:
    """Return a number that knows its text.

    Args:
        value: The number.
        text: How it is written.
    """
    number = WrittenInt(value) if isinstance(value, int) else WrittenFloat(value)
    number.written = text
    return number


def plain_number(value: float) -> int | float:
    """Return a number of no other class than `int`, `float` or `bool`."""
    match value:
        case WrittenInt():
            return int(value)
        case WrittenFloat():
            return float(value)
        case _:
            return value
