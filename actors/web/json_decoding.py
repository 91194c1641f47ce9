"""JSON that browsers and programs send. Pure."""

from __future__ import annotations

from typing import TypeVar

import msgspec

T = TypeVar("T")


def decode_json(data: bytes | str, kind: type[T]) -> T:
    """Return what a JSON text says.

    Args:
        data: The text.
        kind: The type that it must fit.

    Raises:
        msgspec.DecodeError: It is not JSON, is not UTF-8, is nested too deeply, or does not fit the type.
    """
    try:
        return msgspec.json.decode(data, type=kind)
    except UnicodeDecodeError:  # msgspec raises it, and RecursionError, beside its own errors
        raise msgspec.DecodeError("JSON is malformed: it is not UTF-8") from None
    except RecursionError:
        raise msgspec.DecodeError("JSON is malformed: it is nested too deeply") from None
