"""A call that another thread than the loop's has made."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from proto.wire.frames import RequestEntry


class ThreadCall:
    """Takes the place of a CallFuture, which belongs to the loop, and takes a turn of it to be done.

    Attributes:
        number: The client's number for the call; 0 before it is made.
        request: What was sent, for as long as it may have to be sent again.
        response: The response.
        error: The error with which it has failed.
    """

    __slots__ = ("error", "number", "request", "response")

    def __init__(self) -> None:
        self.number = 0
        self.request: RequestEntry | None = None
        self.response: Any = None
        self.error: Exception | None = None

    def completed(self) -> None:
        """Use the response or the error; called once, in the loop."""
        raise NotImplementedError

    def ended(self) -> None:
        """Free the request."""
        self.request = None

    def done(self) -> bool:
        """Return whether it is done: not while it is pending, and it is completed only then."""
        return False

    def set_result(self, response: Any) -> None:
        """Complete the call with its response."""
        self.response = response
        self.completed()

    def set_exception(self, error: Exception) -> None:
        """Complete the call with an error."""
        self.error = error
        self.completed()
