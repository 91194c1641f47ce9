"""Opens a client's connection: TCP, TLS or a unix socket, as the URL says and the broker offers."""

from __future__ import annotations

from typing import TYPE_CHECKING

from proto.aio.local_socket import connect_beside
from proto.aio.tls import client_context

if TYPE_CHECKING:
    import asyncio

    from proto.wire.tls import TlsFiles
    from proto.wire.url import BrokerUrl


async def connect(
    loop: asyncio.AbstractEventLoop, channel: asyncio.BufferedProtocol, url: BrokerUrl, files: TlsFiles
) -> None:
    """Connect a channel to a broker; with TLS, its handshake goes on afterwards.

    A broker of this user on this machine is reached by the unix socket beside its port, if it has one.

    Args:
        loop: The running loop.
        channel: The client's channel.
        url: The broker.
        files: For TLS.

    Raises:
        OSError: Nothing accepts the connection.
        TlsFileError: A file cannot be used.
        ValueError: The host cannot be a name.
    """
    if url.path:
        await loop.create_unix_connection(lambda: channel, url.path)
    elif url.tls:
        from proto.aio.tls_transport import TlsTransport  # noqa: PLC0415 - imports ssl

        protocol = TlsTransport(channel, client_context(files), loop=loop, host=url.host)
        await loop.create_connection(lambda: protocol, url.host, url.port)
    elif (sock := connect_beside(url.host, url.port)) is not None:
        try:
            await loop.create_unix_connection(lambda: channel, sock=sock)
        except BaseException:
            sock.close()
            raise
    else:
        await loop.create_connection(lambda: channel, url.host, url.port)
