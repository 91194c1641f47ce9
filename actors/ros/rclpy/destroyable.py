"""Base of the things that a node makes: in a `with` block, they are destroyed at its end."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, Self

from actors.ros.rclpy.exceptions import InvalidHandle

if TYPE_CHECKING:
    from types import TracebackType


class Handle:
    """In place of rclpy's handle of a C object, which programs hold.

    Args:
        is_valid: Whether the object has not been destroyed; otherwise a `with` block raises InvalidHandle.
    """

    def __init__(self, *, is_valid: bool) -> None:
        self._is_valid = is_valid

    def __enter__(self) -> Self:
        if not self._is_valid:
            raise InvalidHandle("It has been destroyed")
        return self

    def __exit__(self, *exception: object) -> None:
        """Do nothing."""


VALID: Final = Handle(is_valid=True)
DESTROYED: Final = Handle(is_valid=False)


class Destroyable:
    """A publisher, or an entity: something with `destroy`.

    Attributes:
        lifeline: Keeps callboard's node in service, for those that are of use without the node.
        type_claim: Keeps a topic from having another type in the context.
        node_logger_name: The name of the node's logger.
    """

    lifeline: object = None
    type_claim: object = None
    node_logger_name = ""
    _is_destroyed = False

    @property
    def handle(self) -> Handle:
        """In place of rclpy's handle."""
        return DESTROYED if self._is_destroyed else VALID

    @property
    def logger_name(self) -> str:
        """The name of the node's logger."""
        with self.handle:
            return self.node_logger_name

    def destroy(self) -> None:
        """Take it out of service."""
        self._is_destroyed = True
        self.type_claim = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        exc_type: type[BaseException] | None,
        exc_val: BaseException | None,
        exc_tb: TracebackType | None,
    ) -> None:
        self.destroy()
