"""Finds out what listens at an address in use: another callboard broker, or something else."""

from __future__ import annotations

import asyncio
import secrets
from typing import TYPE_CHECKING, Final

from proto import limits
from proto.errors import ErrorCode, ProtocolError
from proto.untrusted_text import escape
from proto.wire import frames
from proto.wire.codec import decode, encode
from proto.wire.identity import agent

if TYPE_CHECKING:
    from collections.abc import Mapping

    from proto.wire.url import BrokerUrl

PROBE_TIMEOUT_SEC: Final = 1.0
"""For connecting and the answer together; a broker on the same machine answers within milliseconds."""

_REFUSALS: Final[Mapping[int, str]] = {
    ErrorCode.UNAUTHORIZED: "with access rules",
    ErrorCode.TLS_REQUIRED: "with TLS",
}


async def find_broker(url: BrokerUrl) -> str | None:
    """Return which callboard broker listens at `url`. It asks without TLS: a broker with TLS says so.

    Returns:
        Its agent, such as "callboard-broker/0.1.0"; None if nothing answers as a callboard broker within
        PROBE_TIMEOUT_SEC.
    """
    try:
        async with asyncio.timeout(PROBE_TIMEOUT_SEC):
            answer = await _greet(url)
    except (OSError, EOFError, ProtocolError):  # TimeoutError is an OSError
        return None
    if isinstance(answer, frames.Welcome):
        return escape(str(answer.options.get("agent", "?")))[:80]
    if isinstance(answer, frames.Error):
        return _REFUSALS.get(answer.code, "another version")
    return None


async def _greet(url: BrokerUrl) -> frames.Frame:
    if url.path:
        reader, writer = await asyncio.open_unix_connection(url.path)
    else:
        reader, writer = await asyncio.open_connection(url.host, url.port)
    try:
        identity = secrets.token_bytes(limits.INSTANCE_BYTES)
        options: frames.Options = {"agent": agent("callboard-probe"), "instance": identity, "token": identity}
        writer.write(encode(frames.Hello(limits.PROTOCOL_VERSION, options)))
        head = await reader.readexactly(limits.PREFIX_BYTES)
        size = min(int.from_bytes(head[1:], "big"), limits.MAX_HELLO_BYTES)
        return decode(head + await reader.readexactly(size))
    finally:
        writer.close()
