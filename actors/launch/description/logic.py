"""Substitutions with the value "true" or "false", and one that chooses between two values.

    IfElseSubstitution(EqualsSubstitution(LaunchConfiguration("robot"), "r2"), "fast", "slow")

True and false are written as for options: true, yes, on, 1, false, no, off, 0.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, TypeAlias

from actors.launch.description.conditions import parse_condition, to_bool
from actors.launch.description.options import option, required
from actors.launch.description.substitutions import Substitution, resolve

if TYPE_CHECKING:
    from actors.launch.description.substitutions import LaunchContext, Text

Truth: TypeAlias = "bool | Text"
Value: TypeAlias = "bool | int | float | Text"


class TruthSubstitution(Substitution):
    """A substitution whose value is "true" or "false"."""

    def perform(self, context: LaunchContext) -> str:
        return str(self._is_true(context)).lower()

    @abstractmethod
    def _is_true(self, context: LaunchContext) -> bool: ...


@dataclass(frozen=True)
class BooleanSubstitution(TruthSubstitution):
    """A truth value, written as "true" or "false"."""

    value: Truth = field(metadata=required("The value."))

    def _is_true(self, context: LaunchContext) -> bool:
        return to_bool(self.value, context)


@dataclass(frozen=True)
class NotSubstitution(TruthSubstitution):
    """The opposite of a value."""

    value: Truth = field(metadata=required('The value: a `bool`, or a word such as "true", "yes", "0".'))

    def _is_true(self, context: LaunchContext) -> bool:
        return not to_bool(self.value, context)


@dataclass(frozen=True)
class AndSubstitution(TruthSubstitution):
    """Whether both values are true. The second is evaluated only if the first is true."""

    left: Truth = field(metadata=required('The first value: a `bool`, or a word such as "true", "yes", "0".'))
    right: Truth = field(metadata=required("The second value."))

    def _is_true(self, context: LaunchContext) -> bool:
        return to_bool(self.left, context) and to_bool(self.right, context)


@dataclass(frozen=True)
class OrSubstitution(TruthSubstitution):
    """Whether one of two values is true. The second is evaluated only if the first is false."""

    left: Truth = field(metadata=required('The first value: a `bool`, or a word such as "true", "yes", "0".'))
    right: Truth = field(metadata=required("The second value."))

    def _is_true(self, context: LaunchContext) -> bool:
        return to_bool(self.left, context) or to_bool(self.right, context)


@dataclass(frozen=True, init=False)
class AllSubstitution(TruthSubstitution):
    """Whether all values are true: AllSubstitution(a, b, c). Evaluation ends at the first that is false.

    Attributes:
        values: The values: a `bool`, or a word such as "true", "yes", "0".
    """

    values: tuple[Truth, ...]

    def __init__(self, *values: Truth) -> None:
        object.__setattr__(self, "values", values)

    def _is_true(self, context: LaunchContext) -> bool:
        return all(to_bool(each, context) for each in self.values)


@dataclass(frozen=True, init=False)
class AnySubstitution(TruthSubstitution):
    """Whether one of the values is true: AnySubstitution(a, b, c). Evaluation ends at that one.

    Attributes:
        values: The values: a `bool`, or a word such as "true", "yes", "0".
    """

    values: tuple[Truth, ...]

    def __init__(self, *values: Truth) -> None:
        object.__setattr__(self, "values", values)

    def _is_true(self, context: LaunchContext) -> bool:
        return any(to_bool(each, context) for each in self.values)


@dataclass(frozen=True)
class EqualsSubstitution(TruthSubstitution):
    """Whether two values are equal: as truth values, as numbers, or else as strings."""

    left: Value = field(metadata=required("A string, number or bool."))
    right: Value = field(metadata=required("Another one."))

    def _is_true(self, context: LaunchContext) -> bool:
        left, right = _text(self.left, context), _text(self.right, context)
        words = {parse_condition(left), parse_condition(right)}
        if None not in words:
            return len(words) == 1
        one, other = _number(left), _number(right)
        if one is not None and other is not None:
            return math.isclose(one, other)
        return left == right


@dataclass(frozen=True)
class NotEqualsSubstitution(EqualsSubstitution):
    """Whether two values differ."""

    def _is_true(self, context: LaunchContext) -> bool:
        return not super()._is_true(context)


@dataclass(frozen=True)
class IfElseSubstitution(Substitution):
    """One of two values. The other one is not evaluated."""

    condition: Truth = field(metadata=required("Chooses the value."))
    if_value: Text = option("", "The value if it is true.")
    else_value: Text = option("", "The value if it is false.")

    def perform(self, context: LaunchContext) -> str:
        return resolve(self.if_value if to_bool(self.condition, context) else self.else_value, context)


def _text(value: Value, context: LaunchContext) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return str(value) if isinstance(value, int | float) else resolve(value, context)


def _number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None
