"""What endpoints are told of counterparts that do not fit: each pair once, a newcomer not of hundreds."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from broker.deliveries import Send
from proto import frames, limits

if TYPE_CHECKING:
    from collections.abc import Callable

    from broker.deliveries import Delivery
    from broker.records import Endpoint
    from proto.codes import NoticeKind

MAX_NOTICES: Final = 16
"""Misfits that one declaration is told of one by one; one NOTICE more of each kind sums up the others.
Each of them is told of it in any case."""


def type_difference(one: str, other: str) -> str:
    """Say how two types with these names, which do not match, differ, and how to mend a frequent mistake."""
    if one == other:
        return "the definitions of the type differ"
    if one.rpartition("/")[2] != other.rpartition("/")[2]:
        return "the types differ"
    return (
        "the types differ. If they are one class in two scripts, put it in a module that both import, or give"
        " both classes the same type_name="
    )


class Notices:
    """The NOTICEs of one graph's topics, or of its services.

    Args:
        emit: Takes each delivery.
    """

    def __init__(self, emit: Callable[[Delivery], None]) -> None:
        self._emit = emit
        self._newcomer: Endpoint | None = None
        self._told = 0
        self._untold: dict[NoticeKind, frames.Notice] = {}
        """What sums up the notices that are too many for the newcomer."""

    def begin(self, newcomer: Endpoint) -> None:
        """An endpoint that is new or back is going to be matched."""
        self._newcomer, self._told = newcomer, 0

    def tell(self, endpoint: Endpoint, kind: NoticeKind, text: str, policy: int = 0) -> None:
        """One of the two of a pair is to be told of the other."""
        text = text[: limits.MAX_ERROR_TEXT]
        newcomer = endpoint is self._newcomer
        self._told += newcomer
        if not newcomer or self._told <= MAX_NOTICES:
            self._emit(Send(endpoint.peer.id, frames.Notice(endpoint.id, kind, text, policy, 1)))
            return
        before = self._untold.get(kind)
        count = 1 if before is None else before.peers + 1
        text = f"'{endpoint.name}': the same with {count} more"
        self._untold[kind] = frames.Notice(endpoint.id, kind, text, policy, count)

    def end(self) -> None:
        """The newcomer has been matched: tell it how many others there are."""
        assert self._newcomer is not None
        for notice in self._untold.values():
            self._emit(Send(self._newcomer.peer.id, notice))
        self._untold.clear()
        self._newcomer = None
