"""Base of the things that a node makes: in a `with` block, they are destroyed at its end."""

from __future__ import annotations

from typing import TYPE_CHECKING, Self

if TYPE_CHECKING:
    from types import TracebackType


class Handle:
    """In place of rclpy's handle of a C object: programs check that there is one, and hold it."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exception: object) -> None:
        """Do nothing."""


class Destroyable:
    """A publisher, or an entity: something with `destroy`.

    Attributes:
        handle: In place of rclpy's handle.
    """

    # One for all: it has no state.
    handle = Handle()

    def destroy(self) -> None:
        """Take it out of service."""
        raise NotImplementedError

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        exc_type: type[BaseException] | None,
        exc_val: BaseException | None,
        exc_tb: TracebackType | None,
    ) -> None:
        self.destroy()
