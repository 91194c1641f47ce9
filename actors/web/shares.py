"""Something limited that holders of connections use: each has at most a share, so that others have theirs."""

from __future__ import annotations

from collections import Counter
from contextlib import contextmanager
from typing import TYPE_CHECKING

from proto.errors import CallboardError

if TYPE_CHECKING:
    from collections.abc import Callable, Generator

    from actors.web.connection_table import Holder


class ShareUsedUpError(CallboardError):
    """A limit of the web server is reached. Try again later."""


class Shares:
    """How much of something each holder uses.

    Args:
        what: Its name in the plural, for errors.
        on_refused: Called with a holder that gets nothing.
    """

    def __init__(self, what: str, on_refused: Callable[[Holder], object]) -> None:
        self._what, self._on_refused = what, on_refused
        self._used: Counter[Holder] = Counter()

    @contextmanager
    def use(self, holder: Holder, amount: int, *, share: int, total: int) -> Generator[None]:
        """Use some of it.

        Args:
            holder: Who does.
            amount: How much.
            share: What one holder may use.
            total: What all together may use.

        Raises:
            ShareUsedUpError: It would be too much.
        """
        of_one = self._used[holder] + amount > share
        if of_one or self._used.total() + amount > total:
            self._on_refused(holder)
            most = f"{share} {self._what} of one user or address" if of_one else f"{total} {self._what}"
            raise ShareUsedUpError(f"At most {most} are possible at the same time; try again later")
        self._used[holder] += amount
        try:
            yield
        finally:
            self._used[holder] -= amount
            if not self._used[holder]:
                del self._used[holder]
