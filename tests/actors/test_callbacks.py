"""Tests of what a callback may look like."""

from __future__ import annotations

import asyncio
from functools import partial
from typing import Any

import pytest

from actors.callbacks import as_coroutine, takes


class Handler:
    def one(self, msg: object) -> None: ...

    def two(self, msg: object, info: object) -> None: ...

    async def three(self, a: object, b: object, c: object) -> None: ...


@pytest.mark.parametrize(
    ("callback", "wanted"),
    [
        (Handler().one, 1),
        (Handler().two, 2),
        (lambda msg: None, 1),
        (lambda msg, info: None, 2),
        (lambda msg, seen=None: None, 1),
        (lambda *args: None, 2),
        (print, 2),
        (partial(Handler().two, 1), 1),
        ([].append, 1),
    ],
)
def test_takes_says_with_how_many_arguments_to_call(callback: Any, wanted: int) -> None:
    """Optional parameters are the callback's own; *args get everything."""
    assert takes(callback, (1, 2), "subscription") == wanted


@pytest.mark.parametrize("callback", [Handler().three, lambda: None])
def test_takes_refuses_what_cannot_be_called(callback: Any) -> None:
    """A callback that fits neither number is refused when it is given, in words."""
    with pytest.raises(RuntimeError, match="A subscription callback takes 1 or 2 arguments"):
        takes(callback, (1, 2), "subscription")


async def test_what_can_be_awaited_is_awaited() -> None:
    """A callback may return a future or a task as well as a coroutine; other values are no work."""
    future: asyncio.Future[int] = asyncio.get_running_loop().create_future()
    coroutine = as_coroutine(future)
    assert coroutine is not None
    future.set_result(8)
    assert await coroutine == 8
    assert as_coroutine(8) is None
