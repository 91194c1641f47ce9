"""Substitutions that say yes or no, as "true" and "false", and the one that chooses.

    IfElseSubstitution(EqualsSubstitution(LaunchConfiguration("robot"), "r2"), "fast", "slow")

What means yes and no is the same as in conditions.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

from actors.launch.description.conditions import meaning, truth
from actors.launch.description.substitutions import Substitution, resolve

if TYPE_CHECKING:
    from actors.launch.description.substitutions import Scope, Text

Truth: TypeAlias = "bool | Text"
Value: TypeAlias = "bool | int | float | Text"


class TruthSubstitution(Substitution):
    """A text that is "true" or "false"."""

    def perform(self, scope: Scope) -> str:
        """Return the word."""
        return str(self.holds(scope)).lower()

    @abstractmethod
    def holds(self, scope: Scope) -> bool:
        """Tell whether it is true there."""


@dataclass(frozen=True)
class BooleanSubstitution(TruthSubstitution):
    """A text that means yes or no, as "true" or "false"."""

    value: Truth

    def holds(self, scope: Scope) -> bool:
        """Tell whether it means yes."""
        return truth(self.value, scope)


@dataclass(frozen=True)
class NotSubstitution(TruthSubstitution):
    """The opposite."""

    value: Truth

    def holds(self, scope: Scope) -> bool:
        """Tell whether the value means no."""
        return not truth(self.value, scope)


@dataclass(frozen=True)
class AndSubstitution(TruthSubstitution):
    """Whether both are true; the second is looked at only if the first is."""

    left: Truth
    right: Truth

    def holds(self, scope: Scope) -> bool:
        """Tell whether both are."""
        return truth(self.left, scope) and truth(self.right, scope)


@dataclass(frozen=True)
class OrSubstitution(TruthSubstitution):
    """Whether one of both is true; the second is looked at only if the first is not."""

    left: Truth
    right: Truth

    def holds(self, scope: Scope) -> bool:
        """Tell whether one is."""
        return truth(self.left, scope) or truth(self.right, scope)


@dataclass(frozen=True, init=False)
class AllSubstitution(TruthSubstitution):
    """Whether all are true: AllSubstitution(a, b, c). None is looked at behind one that is not."""

    values: tuple[Truth, ...]

    def __init__(self, *values: Truth) -> None:
        object.__setattr__(self, "values", values)

    def holds(self, scope: Scope) -> bool:
        """Tell whether all are."""
        return all(truth(each, scope) for each in self.values)


@dataclass(frozen=True, init=False)
class AnySubstitution(TruthSubstitution):
    """Whether one of them is true: AnySubstitution(a, b, c). None is looked at behind that one."""

    values: tuple[Truth, ...]

    def __init__(self, *values: Truth) -> None:
        object.__setattr__(self, "values", values)

    def holds(self, scope: Scope) -> bool:
        """Tell whether one is."""
        return any(truth(each, scope) for each in self.values)


@dataclass(frozen=True)
class EqualsSubstitution(TruthSubstitution):
    """Whether two are the same: two words for yes or no, two numbers, or else two texts."""

    left: Value
    right: Value

    def holds(self, scope: Scope) -> bool:
        """Tell whether they are."""
        left, right = _text(self.left, scope), _text(self.right, scope)
        words = {meaning(left), meaning(right)}
        if None not in words:
            return len(words) == 1
        one, other = _number(left), _number(right)
        if one is not None and other is not None:
            return math.isclose(one, other)
        return left == right


@dataclass(frozen=True)
class NotEqualsSubstitution(EqualsSubstitution):
    """Whether two are not the same."""

    def holds(self, scope: Scope) -> bool:
        """Tell whether they are not."""
        return not super().holds(scope)


@dataclass(frozen=True)
class IfElseSubstitution(Substitution):
    """One text or another. Only the one that is chosen must stand for something.

    Attributes:
        condition: What decides.
        if_value: The text if it is true.
        else_value: The text if it is not.
    """

    condition: Truth
    if_value: Text = ""
    else_value: Text = ""

    def perform(self, scope: Scope) -> str:
        """Return the text."""
        return resolve(self.if_value if truth(self.condition, scope) else self.else_value, scope)


def _text(value: Value, scope: Scope) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return str(value) if isinstance(value, int | float) else resolve(value, scope)


def _number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None
