"""The base of the goal handles of clients and servers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Generic, TypeVar

if TYPE_CHECKING:
    from actors.actions.client_goal import ClientGoalHandle
    from actors.actions.server_goal import ServerGoalHandle

NativeT = TypeVar("NativeT", bound="ClientGoalHandle[Any, Any] | ServerGoalHandle[Any, Any, Any]")


class GoalHandle(Generic[NativeT]):
    """A goal; handles of the same side are equal if their goals are.

    Args:
        native: callboard's handle.
    """

    __hash__ = None  # type: ignore[assignment]

    def __init__(self, native: NativeT) -> None:
        self._native = native

    def __eq__(self, other: object) -> bool:
        # Each query of a goal may make a new handle, so that identity means nothing.
        return isinstance(other, type(self)) and self.goal_id == other.goal_id

    @property
    def goal_id(self) -> Any:
        """The goal's id."""
        return self._native.goal_id

    @property
    def status(self) -> int:
        """The goal's state, as far as this side knows."""
        return int(self._native.status)
