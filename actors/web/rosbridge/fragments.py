"""Operations in parts: received ones put together, and sent ones divided. Pure: no clock."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

from actors.web.rosbridge.operations import OperationError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from actors.web.rosbridge.operations import Fragment, Id

MAX_BYTES: Final = 10 * 1024 * 1024
"""Of all fragments that a client has sent and whose operations are not whole, as of one frame. A character
counts as one."""

MAX_TOTAL: Final = 10_000
"""Fragments of one operation."""

MAX_INCOMPLETE: Final = 16
"""Operations of which parts are missing."""

TIMEOUT_SEC: Final = 600.0
"""Seconds without a further fragment after which the others of its operation are dropped, as in
rosbridge_suite."""


@dataclass(slots=True)
class _Incomplete:
    """An operation of which parts are missing.

    Attributes:
        total: How many parts it has.
        newest_sec: When the newest part came.
        parts: Those that have come, by number.
        size: Their characters.
    """

    total: int
    newest_sec: float
    parts: dict[int, str] = field(default_factory=dict[int, str])
    size: int = 0


class Fragments:
    """The fragments that one client has sent."""

    def __init__(self) -> None:
        self._incomplete: dict[Id, _Incomplete] = {}

    def add(self, fragment: Fragment, now_sec: float) -> str | None:
        """Add a fragment.

        Args:
            fragment: The fragment.
            now_sec: The time, by any clock that never goes back.

        Returns:
            The JSON of the operation if it is whole; else None.

        Raises:
            OperationError: The fragment does not fit the others, or is too much; all of its operation are
                dropped.
        """
        for id_, old in tuple(self._incomplete.items()):
            if now_sec - old.newest_sec > TIMEOUT_SEC:
                del self._incomplete[id_]
        id_ = fragment.id
        if id_ is None:
            raise OperationError("fragment: An id is needed", None, "fragment")
        found = self._incomplete.setdefault(id_, _Incomplete(fragment.total, now_sec))
        if problem := self._problem(fragment, found):
            del self._incomplete[id_]
            raise OperationError(f"fragment: {problem}; those of this id are dropped", id_, "fragment")
        found.parts[fragment.num] = fragment.data
        found.size += len(fragment.data)
        found.newest_sec = now_sec
        if len(found.parts) < found.total:
            return None
        del self._incomplete[id_]
        return "".join(found.parts[number] for number in range(found.total))

    def _problem(self, fragment: Fragment, found: _Incomplete) -> str:
        size = sum(each.size for each in self._incomplete.values()) + len(fragment.data)
        problems = (
            (fragment.total != found.total, f"The total is {fragment.total}, and {found.total} before"),
            (found.total > MAX_TOTAL, f"There may be {MAX_TOTAL} fragments of one operation"),
            (fragment.num >= found.total, f"{fragment.num} is not below the total, {found.total}"),
            (fragment.num in found.parts, f"The number {fragment.num} has been sent before"),
            (len(self._incomplete) > MAX_INCOMPLETE, f"{MAX_INCOMPLETE} operations are incomplete already"),
            (size > MAX_BYTES, f"There are more than {MAX_BYTES} characters"),
        )
        return next((text for is_problem, text in problems if is_problem), "")


def divided(text: str, size: int) -> Iterator[tuple[int, int, str]]:
    """Divide the text of an operation.

    Args:
        text: Its JSON.
        size: The characters of each part at most; more if there would be more than `MAX_TOTAL` parts.

    Returns:
        For each part its number, the total and the part.
    """
    size = max(size, -(-len(text) // MAX_TOTAL))
    total = -(-len(text) // size)
    for number in range(total):
        yield number, total, text[number * size : (number + 1) * size]
