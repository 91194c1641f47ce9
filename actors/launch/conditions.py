"""Conditions: whether an action takes place."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from actors.launch.errors import LaunchError
from actors.launch.substitutions import resolve
from proto.errors import shown

if TYPE_CHECKING:
    from actors.launch.substitutions import Scope, Text

_TRUTH: Final = {"true": True, "1": True, "false": False, "0": False}


class Condition(ABC):
    """What an action may depend on."""

    @abstractmethod
    def holds(self, scope: Scope) -> bool:
        """Tell whether it holds.

        Raises:
            LaunchError: That cannot be said.
        """


@dataclass(frozen=True)
class IfCondition(Condition):
    """Holds if a text is "true" or "1", and not if it is "false" or "0"; the case does not matter."""

    predicate: Text

    def holds(self, scope: Scope) -> bool:
        """Tell whether it holds."""
        return truth(self.predicate, scope)


@dataclass(frozen=True)
class UnlessCondition(Condition):
    """Holds if the text is "false" or "0"."""

    predicate: Text

    def holds(self, scope: Scope) -> bool:
        """Tell whether it holds."""
        return not truth(self.predicate, scope)


def truth(text: Text, scope: Scope) -> bool:
    """Return what a text says that means yes or no.

    Raises:
        LaunchError: It means neither.
    """
    word = resolve(text, scope)
    try:
        return _TRUTH[word.strip().lower()]
    except KeyError:
        raise LaunchError(f"Expected true, 1, false or 0, got '{shown(word)}'") from None
