"""Callbacks that users add around setting parameters: before it, to decide about it, and after it."""

from __future__ import annotations

import inspect
import warnings
from collections.abc import Callable
from typing import Any, Protocol, TypeAlias, TypeVar

from actors.parameters.errors import ParameterModifiedInCallbackError
from actors.parameters.types import Parameter

C = TypeVar("C", bound=Callable[..., Any])


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


def require_plain(callback: C) -> C:
    """Return the callback; raise TypeError for an `async def`, which nothing would await."""
    if inspect.iscoroutinefunction(callback):
        raise TypeError(f"A callback around setting parameters must be a plain function, got {callback!r}")
    return callback


class ParameterCallbacks:
    """The callbacks of one node; of each kind the last one added is called first.

    On-set and post-set callbacks get lists of their own: what they do with them changes nothing else.

    A callback that adds or removes callbacks changes the next operation, not the one it is called for.

    Attributes:
        pre_set: May change the parameters to set.
        on_set: Accept or refuse values.
        post_set: Are notified of values that have been set.
    """

    def __init__(self) -> None:
        self.pre_set: list[PreSetCallback] = []
        self.on_set: list[OnSetCallback] = []
        self.post_set: list[PostSetCallback] = []
        self._deciding = False
        """Whether a pre-set or on-set callback runs."""

    def require_idle(self, name: str) -> None:
        """Raise ParameterModifiedInCallbackError if a callback is deciding about values."""
        if self._deciding:
            raise ParameterModifiedInCallbackError(name)

    def rewrite(self, parameters: list[Parameter]) -> list[Parameter] | None:
        """Return the parameters that the pre-set callbacks want set; None if one refuses them all."""
        # Otherwise a callback could set parameters, and the outer operation would overwrite them with its own
        # values.
        self._deciding = True
        try:
            # A copy, since a callback may add or remove callbacks.
            for callback in tuple(self.pre_set):
                parameters = callback(parameters)
                if not parameters:
                    return None
            return parameters
        finally:
            self._deciding = False

    def refusal(self, parameters: list[Parameter]) -> str:
        """Return why an on-set callback refuses the values, "" if none does."""
        self._deciding = True
        try:
            for callback in tuple(self.on_set):
                outcome = callback([*parameters])
                # The first refusal decides; later callbacks are not asked.
                if getattr(outcome, "successful", None) is None:
                    warnings.warn(
                        f"The on-set callback {callback!r} returned {outcome!r}, not a SetParametersResult:"
                        " the values are refused",
                        stacklevel=2,
                    )
                    return "an on-set callback returned no SetParametersResult"
                if not outcome.successful:
                    return outcome.reason or "an on-set callback refused it"
            return ""
        finally:
            self._deciding = False

    def notify(self, parameters: list[Parameter]) -> None:
        """Call the post-set callbacks."""
        for callback in tuple(self.post_set):
            callback([*parameters])
