"""Actions that repeat what a function returns."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from actors.launch import LaunchError
from actors.launch.description.substitutions import resolve
from actors.launch.documents.errors import DocumentError
from actors.launch.documents.parsing import yaml_data
from actors.ros.launch.description import Action
from proto.untrusted_text import escape

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from actors.launch import LaunchContext
    from actors.launch.description.action import Action as CallboardAction
    from actors.launch.description.substitutions import Text


class ForEach(Action):
    """Actions for each of some values.

    Args:
        input_values: Mappings in YAML, separated by semicolons: "{name: left, id: 1};{name: right, id: 2}".
        function: Called with each mapping's values by name; returns actions, or None.
        given: The options of all actions, such as `condition`.
    """

    def __init__(
        self, input_values: Text, *, function: Callable[..., Iterable[CallboardAction] | None], **given: Any
    ) -> None:
        super().__init__(**given)
        self._values, self._function = input_values, function

    def execute(self, context: LaunchContext) -> list[CallboardAction]:
        """Return the actions for all values.

        Raises:
            LaunchError: The values are malformed.
        """
        texts = [each for each in resolve(self._values, context).split(";") if each.strip()]
        return [action for each in texts for action in self._function(**_mapping(each)) or ()]


class ForLoop(Action):
    """Actions for each number from 0 on.

    Args:
        length: How many.
        function: Called with each number; returns actions, or None.
        given: The options of all actions, such as `condition`.
    """

    def __init__(
        self, length: Text, *, function: Callable[[int], Iterable[CallboardAction] | None], **given: Any
    ) -> None:
        super().__init__(**given)
        self._length, self._function = length, function

    def execute(self, context: LaunchContext) -> list[CallboardAction]:
        """Return the actions for all numbers.

        Raises:
            LaunchError: The length is no number.
        """
        text = resolve(self._length, context)
        try:
            length = int(text)
        except ValueError:
            raise LaunchError(f"ForLoop needs a whole number, not '{escape(text)}'") from None
        return [action for number in range(length) for action in self._function(number) or ()]


def _mapping(text: str) -> dict[str, Any]:
    try:
        value: Any = yaml_data(text.encode())
    except DocumentError:
        value = None
    if not isinstance(value, dict):
        raise LaunchError(f"ForEach needs mappings such as {{name: left}}, not '{escape(text)}'")
    return value  # pyright: ignore[reportUnknownVariableType]  # keys are strings there
