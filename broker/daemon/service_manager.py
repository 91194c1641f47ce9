"""Reports the daemon's state to systemd, as sd_notify(3) does: ready, reloading, stopping, alive."""

from __future__ import annotations

import asyncio
import logging
import os
import socket
import time
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Mapping

logger: Final = logging.getLogger("callboard.broker")

SEND_TIMEOUT_SEC: Final = 1.0
_USEC: Final = 1_000_000


class ServiceManager:
    """The service manager that has started this process; without one, nothing is sent.

    Args:
        environ: The environment with systemd's NOTIFY_SOCKET, and with WATCHDOG_USEC and WATCHDOG_PID if it
            watches this process.
    """

    def __init__(self, environ: Mapping[str, str]) -> None:
        address = environ.get("NOTIFY_SOCKET", "")
        # systemd writes "@" for the zero byte at the start of an abstract address.
        self._address = "\0" + address[1:] if address.startswith("@") else address
        self.watchdog_sec = _watchdog_sec(environ) if address else None

    def notify_ready(self, status: str) -> None:
        """Report that the broker listens, or has finished a reload.

        Args:
            status: One line for `systemctl status`.
        """
        self._send("READY=1", f"STATUS={status}")

    def notify_reloading(self) -> None:
        """Report that a reload begins; `notify_ready` reports its end."""
        self._send("RELOADING=1", f"MONOTONIC_USEC={time.monotonic_ns() // 1000}")

    def notify_stopping(self, timeout_sec: float) -> None:
        """Report that the broker stops.

        Args:
            timeout_sec: The longest time that the stop may take; systemd waits so long before it kills the
                process.
        """
        self._send("STOPPING=1", "STATUS=Stopping", f"EXTEND_TIMEOUT_USEC={round(timeout_sec * _USEC)}")

    async def keep_alive(self) -> None:
        """Reset the watchdog twice within its time until cancelled; return at once without a watchdog.

        A loop that hangs does not run this, so systemd kills and restarts the process.
        """
        while self.watchdog_sec is not None:
            self._send("WATCHDOG=1")
            await asyncio.sleep(self.watchdog_sec / 2)

    def _send(self, *lines: str) -> None:
        if not self._address:
            return
        try:
            with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as sock:
                sock.settimeout(SEND_TIMEOUT_SEC)
                text = "\n".join(line.replace("\n", " ") for line in lines)
                sock.sendto(text.encode(errors="replace"), self._address)
        except OSError as error:
            logger.warning("Cannot notify the service manager: %s", error.strerror or error)


def _watchdog_sec(environ: Mapping[str, str]) -> float | None:
    """Return the time within which the service manager expects a sign of life; None if it expects none."""
    period, pid = environ.get("WATCHDOG_USEC", ""), environ.get("WATCHDOG_PID", str(os.getpid()))
    # The environment may come from a parent process: only the process with this id is watched.
    if not period.isdecimal() or int(period) == 0 or pid != str(os.getpid()):
        return None
    return int(period) / _USEC
