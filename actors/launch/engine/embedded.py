"""A broker for a launch, when there is none where its nodes will look for one."""

from __future__ import annotations

import asyncio
from contextlib import asynccontextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Final

from actors.errors import BrokerUnreachable
from actors.graph.inspector import inspector_for
from proto.wire.url import LOOPBACK_HOSTS

if TYPE_CHECKING:
    from collections.abc import AsyncGenerator

    from actors.config.contexts import BrokerTarget
    from proto.wire.url import BrokerUrl

CONNECT_TIMEOUT_SEC: Final = 2.0


async def broker_is_there(target: BrokerTarget) -> bool:
    """Return whether a broker answers at one of these places. The loop goes on meanwhile.

    Raises:
        BrokerUnreachable: Something has the port there that does not answer as a broker does.
        NotAuthorized: The broker requires other credentials.
    """
    return await asyncio.to_thread(_answers, target)


def can_embed(url: BrokerUrl) -> bool:
    """Return whether this process can be the broker there: at a socket, or a port of the loopback device.

    It has no certificate, so not with TLS.
    """
    return bool(url.path) or (url.host in LOOPBACK_HOSTS and not url.tls)


@asynccontextmanager
async def embedded_broker(url: BrokerUrl) -> AsyncGenerator[None]:
    """A broker at this place, in this process.

    Raises:
        broker.ListenError: It cannot listen there.
    """
    from broker import Broker, BrokerOptions  # noqa: PLC0415 - seldom needed

    options = BrokerOptions(unix=Path(url.path)) if url.path else BrokerOptions(host=url.host, port=url.port)
    async with Broker(options):
        yield


def _answers(target: BrokerTarget) -> bool:
    inspector = inspector_for(target, CONNECT_TIMEOUT_SEC)
    try:
        inspector.connect()
    except BrokerUnreachable:
        if inspector.listening is not None:
            raise
        return False
    inspector.close()
    return True
