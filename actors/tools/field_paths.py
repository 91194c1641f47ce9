"""Fields of messages by paths such as `pose.position.x` or `ranges[3]`."""

from __future__ import annotations

import re
from typing import Any, Final, cast

from actors.interfaces.message import Message
from proto.errors import CallboardError

_PATH: Final = re.compile(r"\w+(\[\d+\])*(\.\w+(\[\d+\])*)*")


class InvalidFieldError(CallboardError, ValueError):
    """A path is malformed, or leads to nothing in a message. Correct it."""


def require_path(path: str) -> None:
    """Check the form of a path.

    Args:
        path: The field, such as `pose.position.x`.

    Raises:
        InvalidFieldError: It has another form.
    """
    if not _PATH.fullmatch(path):
        raise InvalidFieldError(f"Invalid field value '{path}'")


def value_at(message: Any, path: str) -> Any:
    """Return a field of a message.

    Args:
        message: A message, or the dict of a message of unknown type.
        path: The field.

    Raises:
        InvalidFieldError: There is no such field.
    """
    value = message
    for step in re.findall(r"\w+", path):
        try:
            if isinstance(value, dict):
                value = cast("dict[str, Any]", value)[step]
            elif isinstance(value, Message):
                value = getattr(value, step if step in value.__struct_fields__ else "")
            else:
                value = value[int(step)]
        except (AttributeError, IndexError, KeyError, TypeError, ValueError):
            raise InvalidFieldError(f"Invalid field '{path}': there is no '{step}' in it") from None
    return value
