"""The service server as users hold it."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from actors.endpoints.reply_order import attributes_after
from actors.endpoints.service.endpoint import ServiceEndpoint
from actors.endpoints.service_introspection import Introspectable

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.endpoints.context import NodeContext
    from actors.endpoints.publisher.publisher import Publisher

Q = TypeVar("Q")
A = TypeVar("A")


class ServiceServer(Introspectable[ServiceEndpoint], Generic[Q, A]):
    """Serves requests. Made by `Node.create_service`.

    The callback is `(request, response) -> response` or `(request) -> response`, `def` or `async def`. An
    exception that it raises reaches the caller as RemoteError and is logged here. A handler whose caller has
    given up is cancelled. With `raw=True` it is `(request) -> response`, both bytes: messages as msgpack.

    Attributes:
        srv_type: The service class.
        srv_name: The full name of the service.
    """

    def __init__(
        self,
        context: NodeContext,
        srv_type: type,
        request_type: type[Any],
        response_type: type[Any],
        name: str,
        *,
        callback: Callable[..., Any],
        concurrent: bool,
        raw: bool = False,
    ) -> None:
        super().__init__(
            ServiceEndpoint(
                context, srv_type, request_type, response_type, name, callback=callback,
                concurrent=concurrent, raw=raw,
            )
        )  # fmt: skip

    @property
    def pending(self) -> int:
        """Requests that wait or are being handled."""
        return len(self._endpoint.waiting.entries) + len(self._endpoint.running)

    @property
    def calls(self) -> int:
        """Requests handed to the callback so far."""
        return self._endpoint.calls

    @property
    def served(self) -> int:
        """Requests answered so far, errors included."""
        return self._endpoint.replies.sent

    @property
    def errors(self) -> int:
        """Requests answered with an error so far."""
        return self._endpoint.replies.errors

    def reply_after(self, publisher: Publisher[Any]) -> None:
        """Let replies say which messages they follow: those published before may arrive after them.

        Clients with `receive_after` hold them back, as action clients do with results until they have the
        feedback.

        Args:
            publisher: What it has published when a reply is made comes before the reply.
        """
        self._endpoint.reply_attributes = partial(attributes_after, publisher)

    def destroy(self) -> None:
        """Take the service out of service: handlers are cancelled, their callers get ServiceUnavailable."""
        super().destroy()
