"""Entities that take part in the transitions of a lifecycle node."""

from __future__ import annotations

from functools import wraps
from typing import TYPE_CHECKING, Any, overload

from actors.lifecycle.states import TransitionCallbackReturn

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.lifecycle.states import LifecycleState


class ManagedEntity:
    """Has a callback for each transition; each gets the state that the node was in, and does nothing here."""

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Take part in the transition to inactive."""
        return TransitionCallbackReturn.SUCCESS

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Take part in the transition to unconfigured."""
        return TransitionCallbackReturn.SUCCESS

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Take part in the transition to finalized."""
        return TransitionCallbackReturn.SUCCESS

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Take part in the transition to active."""
        return TransitionCallbackReturn.SUCCESS

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Take part in the transition from active to inactive."""
        return TransitionCallbackReturn.SUCCESS

    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Clean up after another callback has returned ERROR or raised."""
        return TransitionCallbackReturn.SUCCESS


class SimpleManagedEntity(ManagedEntity):
    """Knows whether it is activated."""

    def __init__(self) -> None:
        self._enabled = False

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Become activated."""
        self._enabled = True
        return TransitionCallbackReturn.SUCCESS

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Become deactivated."""
        self._enabled = False
        return TransitionCallbackReturn.SUCCESS

    @property
    def is_activated(self) -> bool:
        """Whether it is activated."""
        return self._enabled

    @overload
    @staticmethod
    def when_enabled(
        wrapped: None = None, *, when_not_enabled: Callable[..., None] | None = None
    ) -> Callable[[Callable[..., None]], Callable[..., None]]: ...

    @overload
    @staticmethod
    def when_enabled(
        wrapped: Callable[..., None], *, when_not_enabled: Callable[..., None] | None = None
    ) -> Callable[..., None]: ...

    @staticmethod
    def when_enabled(
        wrapped: Callable[..., None] | None = None, *, when_not_enabled: Callable[..., None] | None = None
    ) -> Any:
        """Decorate a method that does nothing unless the entity is activated.

        Args:
            wrapped: The method.
            when_not_enabled: Called without arguments instead of it.

        Returns:
            The method; without `wrapped`, a decorator.
        """

        def decorate(method: Callable[..., None]) -> Callable[..., None]:
            @wraps(method)
            def guarded(self: SimpleManagedEntity, *args: Any, **kwargs: Any) -> None:
                if self.is_activated:
                    method(self, *args, **kwargs)
                elif when_not_enabled is not None:
                    when_not_enabled()

            return guarded

        return decorate if wrapped is None else decorate(wrapped)
