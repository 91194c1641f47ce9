"""Filter messages with a Python expression about `m`, such as `m.data > 3`.

    wanted = MessageFilter("m.pose.position.x > 1.0")
    wanted.passes(message)  # True or False

The expression can do whatever Python can: accept it only from the user who runs the program.
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

from actors.interfaces.errors import InvalidMessageError
from proto.errors import CallboardError


class InvalidFilterError(CallboardError, ValueError):
    """An expression that is not Python, or that failed for a message; the text says why."""


class MessageFilter:
    """A Python expression about a message `m`.

    Args:
        expression: Such as `m.data > 3`. The fields of a dict can be read as attributes, too.

    Raises:
        InvalidFilterError: It is not a Python expression.
    """

    def __init__(self, expression: str) -> None:
        self.expression = expression
        try:
            self._code = compile(expression.strip(), "<filter>", "eval")
        except (SyntaxError, ValueError) as error:
            reason = error.msg if isinstance(error, SyntaxError) else error
            raise InvalidFilterError(
                f"The filter '{expression}' is no Python expression such as 'm.data > 3': {reason}"
            ) from None

    def passes(self, message: object) -> bool:
        """Return whether the expression is true for a message.

        Args:
            message: An instance of its class, or a dict of its fields.

        Raises:
            InvalidFilterError: The expression raised an exception.
            InvalidMessageError: A dict is nested too deeply.
        """
        try:
            view = _attributes(message) if isinstance(message, dict) else message
        except RecursionError:
            raise InvalidMessageError("Not a message: it is nested too deeply") from None
        try:
            return bool(eval(self._code, {"m": view}))  # noqa: S307 - the user wrote it
        except Exception as error:
            raise InvalidFilterError(
                f"The filter '{self.expression}' failed: {type(error).__name__}: {error}"
            ) from error


def _attributes(value: Any) -> Any:
    """Return a view of a dict whose fields are attributes."""
    if isinstance(value, dict):
        return SimpleNamespace(**{str(key): _attributes(item) for key, item in cast("Any", value).items()})
    return [_attributes(item) for item in cast("Any", value)] if isinstance(value, list) else value
