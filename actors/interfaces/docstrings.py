"""The `__doc__` of interface classes: with the comments of their fields, read when somebody asks for it."""

from __future__ import annotations

from typing import Any


class Documentation:
    """The `__doc__` of service and action classes, and in their metaclass that of message classes.

    Args:
        own: The class's own docstring.
    """

    def __init__(self, own: str | None) -> None:
        self._own = own

    def __get__(self, instance: object, owner: type[Any]) -> str | None:
        """Return the text that `help` shows."""
        from actors.interfaces.comments import documentation  # noqa: PLC0415 - seldom needed

        if isinstance(instance, type):
            return documentation(instance, instance.__dict__["__doc__"])
        return self._own if issubclass(owner, type) else documentation(owner, self._own)

    def __set__(self, instance: Any, value: str | None) -> None:
        """Replace the docstring of a message class."""
        # As `type` does. Without this method `help` would find the docstring in the class's dict first.
        type.__dict__["__doc__"].__set__(instance, value)
