"""The standard services of a node, most of which nobody ever calls."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from actors.endpoints.service.endpoint import DeclaredService, ServiceEndpoint
from actors.endpoints.service.request_queue import MAX_QUEUED

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.diagnostics.records import ServiceDiagnostics
    from actors.endpoints.context import NodeContext
    from proto.wire.frames import RequestEntry


class IdleService(DeclaredService):
    """A standard service without requests so far: no more than its declaration.

    The first request makes a `ServiceEndpoint`, which takes its place and its id.

    Args:
        context: The node.
        srv_type: The service class.
        name: The full name of the service.
        callback: The handler: `(request) -> response`.
        concurrent: See `CallbackSource`.
    """

    standard = True

    def __init__(
        self,
        context: NodeContext,
        srv_type: type[Any],
        name: str,
        *,
        callback: Callable[[Any], Any],
        concurrent: bool,
    ) -> None:
        super().__init__(context, srv_type, name)
        self._callback = callback
        self._concurrent = concurrent
        context.link.add(self)

    def requested(self, entries: tuple[RequestEntry, ...]) -> None:
        """Let a `ServiceEndpoint` take the requests, from now on."""
        kind: Any = self.srv_type
        endpoint = ServiceEndpoint(
            self.context, kind, kind.Request, kind.Response, self.srv_name, callback=self._callback,
            concurrent=self._concurrent, replaced=self,
        )  # fmt: skip
        endpoint.requested(entries)

    def retire(self) -> None:
        """Go out of service, as the node stops."""
        self.destroy()

    def diagnostics(self) -> ServiceDiagnostics:
        """Return its state and counts."""
        from actors.diagnostics.records import ServiceDiagnostics  # noqa: PLC0415 - seldom needed

        return ServiceDiagnostics(
            id=self.id,
            service=self.srv_name,
            waiting=0,
            waiting_bytes=0,
            queue_limit=MAX_QUEUED,
            running=0,
            served=0,
            errors=0,
            callback=self.context.watch.of(self._callback, "the service").diagnostics(0),
        )
