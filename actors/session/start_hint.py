"""The hint when no broker answers: the reason, or the command that starts one."""

from __future__ import annotations

import socket
from typing import TYPE_CHECKING

from proto.wire.url import DEFAULT_PORT, LOOPBACK_HOSTS

if TYPE_CHECKING:
    from proto.wire.url import BrokerUrl


def start_hint(url: BrokerUrl, error: BaseException | None = None) -> str:
    """Return "Start one with: callboard broker …"; on another machine it says "there".

    Args:
        url: Where no broker answers.
        error: The error of the attempt to connect. The hint says if the host name cannot be resolved.
    """
    if isinstance(error, socket.gaierror | UnicodeError):
        return f"The host name '{url.host}' cannot be resolved"
    if url.path:
        return f"Start one with: callboard broker --unix {url.path}"
    port = "" if url.port == DEFAULT_PORT else f" --port {url.port}"
    port += " --tls-cert FILE --tls-key FILE" if url.tls else ""
    if url.host in LOOPBACK_HOSTS:
        return f"Start one with: callboard broker{port}"
    return f"Start one there with: callboard broker --host {url.host}{port} --auth FILE"
