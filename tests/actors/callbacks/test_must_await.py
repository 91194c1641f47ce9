"""Coroutines that say when `await` is missing."""

from __future__ import annotations

import asyncio
import inspect
import sys
from collections.abc import Coroutine
from typing import TYPE_CHECKING, Any

import pytest

import actors
from actors.callbacks.must_await import must_await
from actors.interfaces.example_interfaces.srv import AddTwoInts

if TYPE_CHECKING:
    from collections.abc import Callable

    from tests.actors.meeting import Meeting

USES: dict[str, Callable[[Any], object]] = {
    "not": lambda made: not made,
    "for": list,
    "in": lambda made: "/chatter" in made,
    "len": len,
    "==": lambda made: made == 0,
}


@must_await
async def double(number: int) -> int:
    """Return twice the number, after a turn of the loop."""
    await asyncio.sleep(0)
    return 2 * number


@pytest.mark.parametrize("use", USES)
def test_a_use_without_await_is_an_error(use: str) -> None:
    """The error names the method and says what is missing."""
    made = double(1)
    with pytest.raises(TypeError, match=r"^double\(\) is a coroutine: write `await` before it"):
        USES[use](made)
    made.close()


async def test_it_works_wherever_coroutines_do() -> None:
    """Awaited, in tasks, in gather and wait_for, and thrown into."""
    made = double(1)
    assert isinstance(made, Coroutine)
    assert asyncio.iscoroutine(made)
    made.close()

    assert await double(1) == 2
    assert await asyncio.create_task(double(2)) == 4
    assert [*await asyncio.gather(double(3), double(4))] == [6, 8]
    assert await asyncio.wait_for(double(5), 10) == 10
    task = asyncio.create_task(double(6))
    await asyncio.sleep(0)
    task.cancel()
    with pytest.raises(asyncio.CancelledError):
        await task


def test_it_is_a_coroutine_function_for_tools() -> None:
    """From Python 3.12 on, also as a method: frameworks and test doubles look at that."""
    marked = sys.version_info >= (3, 12)
    assert inspect.iscoroutinefunction(double) is marked
    assert inspect.iscoroutinefunction(actors.Node.get_node_names) is marked


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_one_that_is_never_awaited_warns() -> None:
    """As any coroutine does."""
    made = [double(1)]
    with pytest.warns(RuntimeWarning, match="'double' was never awaited"):
        made.clear()


async def test_what_rclpy_returns_at_once_must_be_awaited(meeting: Meeting) -> None:
    """Waits and questions about the graph."""
    node = await meeting.node("node")
    client = node.create_client(AddTwoInts, "add")
    coroutines: list[Any] = [
        client.wait_for_service(1.0),
        node.wait_for_node("/other", 1.0),
        node.get_node_names(),
        node.get_topic_names_and_types(),
        node.count_publishers("chatter"),
        node.get_publishers_info_by_topic("chatter"),
    ]
    for each in coroutines:
        with pytest.raises(TypeError, match="write `await`"):
            assert not each
        each.close()
