"""Responses that handlers give later, in any thread."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from actors.callbacks.callback_future import LateCallback

if TYPE_CHECKING:
    from proto.wire.frames import Options


class LateService(Protocol):
    """The part of a service that late replies use. A protocol: services import this module."""

    def send_late(self, late: LateReply, body: bytes, /) -> None:
        """Send the encoded response to a request, unless it has ended; in any thread."""
        ...

    def fail_late(self, late: LateReply, error: BaseException, /) -> None:
        """Answer a request with an error, unless it has ended; in any thread."""
        ...

    def cancel_late(self, late: LateReply, /) -> None:
        """Answer that a request was cancelled, unless it has ended; in the loop."""
        ...


class LateReply(LateCallback):
    """What a handler of a `concurrent=True` service returns to reply later, in any thread.

    `send`, `fail` and `cancel`: the first one ends the request, and the others do nothing.

    Attributes:
        call: The number of the call.
        attributes: Those of the request.
    """

    __slots__ = ("_service", "attributes", "call")

    def __init__(self) -> None:
        super().__init__()
        self._service: LateService | None = None
        self.call = 0
        self.attributes: Options | None = None

    def begin(self, service: LateService, name: str, call: int, attributes: Options | None) -> None:
        """Belong to a request of a service. Called by it, before `begun`."""
        self._service = service
        self.name = name
        self.call = call
        self.attributes = attributes

    def begun(self) -> None:
        """Begin to make the response; called in the loop."""
        raise NotImplementedError

    @property
    def ended(self) -> bool:
        """Whether the request has ended; perhaps its caller has given it up."""
        return self._service is None

    def send(self, body: bytes) -> None:
        """Send the encoded response; in any thread."""
        service = self._service
        if service is not None:
            service.send_late(self, body)

    def fail(self, error: BaseException) -> None:
        """Answer with an error; in any thread. One that ends the program cancels the request."""
        service = self._service
        if service is not None:
            service.fail_late(self, error)

    def cancel(self) -> None:
        """Answer that the request was cancelled; in the loop."""
        service = self._service
        if service is not None:
            service.cancel_late(self)

    def end(self) -> None:
        """Belong to no request any more. Called by the service."""
        self._service = None
