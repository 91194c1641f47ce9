"""Conditions: whether an action takes place."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar, Final

from actors.launch.description.options import required
from actors.launch.description.substitutions import resolve
from actors.launch.description.validation import Entity
from actors.launch.errors import LaunchError
from proto.untrusted_text import escape

if TYPE_CHECKING:
    from actors.launch.description.substitutions import LaunchContext, Text

_CONDITIONS: Final = {"true": True, "1": True, "false": False, "0": False}
_BOOLS: Final = {**_CONDITIONS, "yes": True, "on": True, "no": False, "off": False}
"""Words of options and parameters, which ROS 2 reads as YAML. It accepts only the others in conditions."""


class Condition(Entity, ABC):
    """A condition of an action."""

    kind: ClassVar[str] = "condition"

    @abstractmethod
    def evaluate(self, context: LaunchContext) -> bool:
        """Evaluate it.

        Args:
            context: The context of the action.

        Returns:
            Whether it holds.

        Raises:
            LaunchError: It has no value there.
        """

    def holds(self, scope: LaunchContext) -> bool:
        """Evaluate it, under its former name.

        Args:
            scope: The context of the action.

        Returns:
            Whether it holds.
        """
        return self.evaluate(scope)


@dataclass(frozen=True)
class IfCondition(Condition):
    """Holds if a string is "true" or "1", and not if it is "false" or "0", in upper or lower case."""

    predicate: Text = field(metadata=required("The string."))

    def evaluate(self, context: LaunchContext) -> bool:
        return evaluate_condition(self.predicate, context)


@dataclass(frozen=True)
class UnlessCondition(Condition):
    """Holds if a string is "false" or "0"."""

    predicate: Text = field(metadata=required("The string."))

    def evaluate(self, context: LaunchContext) -> bool:
        return not evaluate_condition(self.predicate, context)


@dataclass(frozen=True)
class LaunchConfigurationEquals(Condition):
    """Holds if an argument has this value."""

    launch_configuration_name: str = field(metadata=required("The argument."))
    expected_value: Text | None = field(
        metadata=required("The value; None stands for an argument that is not set.")
    )

    def evaluate(self, context: LaunchContext) -> bool:
        context.used.add(self.launch_configuration_name)
        value = context.launch_configurations.get(self.launch_configuration_name)
        return value == (None if self.expected_value is None else resolve(self.expected_value, context))


@dataclass(frozen=True)
class LaunchConfigurationNotEquals(LaunchConfigurationEquals):
    """Holds if an argument has another value, or none."""

    def evaluate(self, context: LaunchContext) -> bool:
        return not super().evaluate(context)


def to_bool(value: bool | Text, context: LaunchContext) -> bool:  # noqa: FBT001 - a bool is one way to write it
    """Convert the value of an option, substitution or parameter to a bool.

    Raises:
        LaunchError: It is neither true, yes, on, 1 nor false, no, off, 0, in upper or lower case.
    """
    if isinstance(value, bool):
        return value
    word = resolve(value, context)
    parsed = parse_bool(word)
    if parsed is None:
        raise LaunchError(f"Expected true or false, got '{escape(word)}'")
    return parsed


def evaluate_condition(predicate: Text, context: LaunchContext) -> bool:
    """Convert the string of a condition to a bool.

    Raises:
        LaunchError: It is neither true, 1, false nor 0, in upper or lower case.
    """
    word = resolve(predicate, context)
    parsed = parse_condition(word)
    if parsed is None:
        raise LaunchError(f"Expected true, 1, false or 0, got '{escape(word)}'")
    return parsed


def parse_condition(word: str) -> bool | None:
    """Convert "true", "1", "false" or "0" to a bool; return None for other words."""
    return _CONDITIONS.get(word.strip().lower())


def parse_bool(word: str) -> bool | None:
    """Convert a word of an option to a bool; return None for other words."""
    return _BOOLS.get(word.strip().lower())
