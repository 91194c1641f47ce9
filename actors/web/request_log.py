"""The log of requests that fail: a line for one that is malformed, a traceback for a fault of ours."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, Any

from aiohttp.http_exceptions import HttpProcessingError

from actors.web.refusals import Refusal

if TYPE_CHECKING:
    from actors.web.refusals import Refusals


class RequestLog(logging.Logger):
    """The logger of the HTTP library, which gives each failed request to `exception`.

    Args:
        refusals: Count and log malformed requests.
    """

    def __init__(self, refusals: Refusals) -> None:
        super().__init__("callboard.web.requests")
        # Not by `getLogger`, which would return the same one for all servers of a process.
        self.parent = logging.getLogger("callboard.web")
        self._refusals = refusals

    def exception(self, msg: object, *args: object, exc_info: Any = True, **options: Any) -> None:
        """Log a request that has failed.

        Args:
            msg: The text.
            args: The address of the client.
            exc_info: The error.
            options: As for `Logger.error`.
        """
        if isinstance(exc_info, HttpProcessingError):
            self._refusals.count(Refusal.MALFORMED, args[0] if args else "A client")
        elif self._refusals.admits_fault():
            super().exception(msg, *args, exc_info=exc_info, **options)
