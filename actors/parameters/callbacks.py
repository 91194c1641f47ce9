"""Callbacks that users add around setting parameters: before it, to decide about it, and after it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol, TypeAlias

from actors.parameters.types import Parameter


class SetParametersOutcome(Protocol):
    """Result of an on-set callback: `SetParametersResult`, or a message with the same fields."""

    @property
    def successful(self) -> bool:
        """Whether the values may be set."""
        ...

    @property
    def reason(self) -> str:
        """Why they may not."""
        ...


PreSetCallback: TypeAlias = Callable[[list[Parameter]], list[Parameter]]
"""Gets the parameters to set and returns those to set instead; an empty list refuses them all."""
OnSetCallback: TypeAlias = Callable[[list[Parameter]], SetParametersOutcome]
"""Gets checked values before they are set, and accepts or refuses them all."""
PostSetCallback: TypeAlias = Callable[[list[Parameter]], None]
"""Gets the values that have been set."""


class ParameterCallbacks:
    """The callbacks of one node; of each kind the last one added is called first."""

    def __init__(self) -> None:
        self._pre_set: list[PreSetCallback] = []
        self._on_set: list[OnSetCallback] = []
        self._post_set: list[PostSetCallback] = []

    def add_pre_set(self, callback: PreSetCallback) -> None:
        """Add a callback that may change the parameters to set."""
        self._pre_set.insert(0, callback)

    def add_on_set(self, callback: OnSetCallback) -> None:
        """Add a callback that accepts or refuses values."""
        self._on_set.insert(0, callback)

    def add_post_set(self, callback: PostSetCallback) -> None:
        """Add a callback that is notified of values that have been set."""
        self._post_set.insert(0, callback)

    def remove(self, callback: PreSetCallback | OnSetCallback | PostSetCallback) -> None:
        """Remove a callback of any kind.

        Raises:
            ValueError: It is not registered.
        """
        for callbacks in (self._pre_set, self._on_set, self._post_set):
            if callback in callbacks:
                callbacks.remove(callback)  # type: ignore[arg-type] # pyright: ignore[reportArgumentType]
                return
        raise ValueError("the callback is not registered")

    def rewrite(self, parameters: list[Parameter]) -> list[Parameter] | None:
        """Return the parameters that the pre-set callbacks want set; None if one refuses them all."""
        for callback in self._pre_set:
            parameters = callback(parameters)
            if not parameters:
                return None
        return parameters

    def refusal(self, parameters: list[Parameter]) -> str:
        """Return why an on-set callback refuses the values, "" if none does."""
        for callback in self._on_set:
            outcome = callback(parameters)
            if not outcome.successful:
                return outcome.reason or "an on-set callback refused it"
        return ""

    def notify(self, parameters: list[Parameter]) -> None:
        """Call the post-set callbacks."""
        for callback in self._post_set:
            callback(parameters)
