"""The interface between panels and their session, and panels that send documents as differences."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias

from actors.web.merge_patch import merge_patch

if TYPE_CHECKING:
    from actors.web.merge_patch import Document

Body: TypeAlias = Callable[[], dict[str, Any] | None]
"""Returns the body of a message to the page, or None for no message."""


class PanelError(Exception):
    """A panel cannot be opened; the message gives the reason."""


class Panel(Protocol):
    """The source of one part of the page.

    It wakes its session when it has something new, and the session pops that when it can send. So nothing is
    queued for a slow browser, which gets the newest state.
    """

    def pop(self) -> Body | None:
        """Take what is new; None if nothing is.

        Returns:
            A function that returns the body of the next message to the page, or None for no message. A thread
            calls it, so it must not touch what the event loop changes.
        """
        ...

    def close(self) -> None:
        """End its subscriptions and listeners."""
        ...


class DocumentPanel:
    """A panel that shows a document, and sends how it differs from what the page has.

    Args:
        wake: Called when the document may have changed.
        watches: Each takes a listener and returns a function that ends it; see `Observer.on_graph`.
    """

    def __init__(
        self,
        wake: Callable[[], None],
        *watches: Callable[[Callable[[], None]], Callable[[], None]],
    ) -> None:
        self._sent: Document = {}
        self._ends = [watch(wake) for watch in watches]
        self._first = True
        wake()

    def document(self) -> Document:
        """Return the document as it is now; JSON's types only. A thread calls it."""
        raise NotImplementedError

    def pop(self) -> Body:
        """Return `patch`: a JSON Merge Patch of what the page has; at first of an empty document."""
        return self._patch

    def _patch(self) -> dict[str, Any] | None:
        document = self.document()
        patch = merge_patch(self._sent, document)
        self._sent = document
        if not patch and not self._first:
            return None
        self._first = False
        return {"patch": patch}

    def close(self) -> None:
        """End the watches."""
        for end in self._ends:
            end()
