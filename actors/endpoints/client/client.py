"""The client as users hold it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Generic, TypeVar

from actors.callbacks.must_await import must_await
from actors.endpoints.client.endpoint import ClientEndpoint
from actors.endpoints.endpoint import endpoint_of
from actors.endpoints.reply_order import HeldReplies
from actors.endpoints.service_introspection import Introspectable
from actors.errors import ServiceUnavailable, WaitTimeout
from actors.interfaces.codec import EncodedCodec, codec_for
from actors.time.timeout import DEFAULT_TIMEOUT

if TYPE_CHECKING:
    import asyncio

    from actors.endpoints.context import NodeContext
    from actors.endpoints.subscription.subscription import Subscription
    from actors.time.timeout import Timeout

Q = TypeVar("Q")
A = TypeVar("A")


class Client(Introspectable[ClientEndpoint], Generic[Q, A]):
    """Calls one service. Made by `Node.create_client`.

    With `raw=True`, requests and responses are bytes: messages as msgpack, which nobody encodes or decodes.

    Attributes:
        srv_type: The service class.
        srv_name: The full name of the service.
        gid: 16 bytes that identify this client in service events.
    """

    def __init__(
        self,
        context: NodeContext,
        srv_type: type,
        request_type: type[Any],
        response_type: type[Any],
        name: str,
        *,
        raw: bool = False,
    ) -> None:
        self._requests: Any = EncodedCodec() if raw else codec_for(request_type)
        replies = EncodedCodec() if raw else codec_for(response_type)
        super().__init__(ClientEndpoint(context, srv_type, replies, name))
        self.gid = self._endpoint.gid

    @property
    def pending(self) -> int:
        """Calls in flight."""
        return len(self._endpoint.pending)

    @property
    def failed(self) -> int:
        """Calls that have ended in an error so far, timeouts included."""
        return self._endpoint.failed

    @property
    def timeouts(self) -> int:
        """Calls whose deadline has passed so far."""
        return self._endpoint.timeouts

    @property
    def late(self) -> int:
        """Replies that arrived after their call had ended."""
        return self._endpoint.late

    def service_is_ready(self) -> bool:
        """Return whether a server is available now.

        Returns:
            True if the client is matched with a server.
        """
        return self._endpoint.peers > 0

    @must_await
    async def wait_for_service(self, timeout_sec: Timeout = DEFAULT_TIMEOUT) -> bool:
        """Wait until a server of this service is available; the broker reports it at once.

        Args:
            timeout_sec: Seconds to wait at most; None for no limit.

        Returns:
            True if there is a server; False if there was none within `timeout_sec`.

        Raises:
            RuntimeError: The node does not run.
            NodeDestroyed: The client or its node has been destroyed.
            ServiceUnavailable: The broker refuses the client; the text says why.
        """
        endpoint = self._endpoint

        def ready() -> bool:
            endpoint.require_alive()
            if endpoint.refusal and not endpoint.peers:
                raise ServiceUnavailable(f"Service '{self.srv_name}': {endpoint.refusal}")
            return endpoint.peers > 0

        try:
            await endpoint.context.wait_until(ready, f"'{self.srv_name}' has no server", timeout_sec)
        except WaitTimeout:
            return False
        return True

    async def call(self, request: Q, timeout_sec: Timeout = DEFAULT_TIMEOUT) -> A:
        """Send a request and wait for the reply.

        Before the node's first session the call waits for that, too, within its deadline. Without a session
        later it fails at once.

        Args:
            request: The request.
            timeout_sec: Seconds to wait at most; None for no limit.

        Returns:
            The response.

        Raises:
            TypeError: `request` is not of the service's request type; nothing was sent.
            InvalidMessageError: A field has a wrong type or is out of range, an encoded request is no msgpack
                map, or the request is larger than the broker takes; nothing was sent.
            ValueError: `timeout_sec` is negative or not a number; nothing was sent.
            RuntimeError: The node does not run.
            NodeDestroyed: The client or its node has been destroyed, before the call or during it.
            ServiceUnavailable: No server or no broker, or it went away before the reply.
            ServiceOverloaded: Too many calls wait already: here (200,000 of a client, 1,000 for the first
                session, or 64 MiB that have not left), in the broker or at the server. Calls that the
                broker refuses because this node's other calls wait for the server are sent again until
                their deadline.
            ServiceTimeout: No reply in time; the handler has been cancelled.
            RemoteError: The handler raised, or did not return a valid response.
        """
        return await self.call_async(request, timeout_sec)

    def call_async(self, request: Q, timeout_sec: Timeout = DEFAULT_TIMEOUT) -> asyncio.Future[A]:
        """Send a request and return a future of the reply.

        Args:
            request: The request.
            timeout_sec: As for `call`.

        Returns:
            A future of the response. It raises the errors that `call` describes for calls that fail;
            cancelling it cancels the handler, too.

        Raises:
            TypeError: `request` is not of the service's request type; nothing was sent.
            InvalidMessageError: A field has a wrong type or is out of range, an encoded request is no msgpack
                map, or the request is larger than the broker takes; nothing was sent.
            ValueError: `timeout_sec` is negative or not a number; nothing was sent.
            RuntimeError: The node does not run.
            NodeDestroyed: The client or its node has been destroyed.
        """
        endpoint, context = self._endpoint, self._endpoint.context
        if endpoint.destroyed:
            endpoint.require_alive()
        body: bytes = self._requests.encode(request)
        if len(body) > context.link.largest:
            context.link.require_fits(f"A request of '{self.srv_name}'", len(body))
        limit = context.default_call_timeout_sec  # inline: it is the limit of nearly every call
        if timeout_sec is not DEFAULT_TIMEOUT:
            limit = context.limit_sec(timeout_sec)
        if not limit >= 0:  # not a number, too
            raise ValueError(f"timeout_sec must be zero or more, got {timeout_sec}")
        return endpoint.call(request, body, limit)

    def receive_after(self, subscription: Subscription[Any]) -> None:
        """Hold replies back until messages have been handed over that the server published before them.

        For at most 1 s, and only replies of a server that says which messages they follow: one with
        `reply_after`, or an action server with its results. At most 1,000 replies wait.

        Args:
            subscription: To the server's topic, with a callback.

        Raises:
            TypeError: The subscription has no callback.
        """
        endpoint = endpoint_of(subscription)
        if endpoint.consumer.callback is None:
            raise TypeError("receive_after() needs a subscription with a callback")
        self._endpoint.held = HeldReplies(endpoint)

    def destroy(self) -> None:
        """Take the client out of service; calls in flight raise NodeDestroyed."""
        self._endpoint.destroy()
