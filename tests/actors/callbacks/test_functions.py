"""Tests of what a callback may look like."""

from __future__ import annotations

import asyncio
from functools import partial
from typing import Any

import pytest

from actors.callbacks.functions import as_coroutine, takes
from actors.errors import error_text


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


class MuteError(Exception):
    """An exception that cannot say what it is."""

    def __str__(self) -> str:
        raise ZeroDivisionError


def test_the_text_of_any_exception_can_be_had() -> None:
    """Also of one whose text is no text, or that UTF-8 cannot hold: it is to travel and to be logged."""
    assert error_text(ValueError("plain")) == "plain"
    assert error_text(MuteError()) == "(an exception without a readable text)"
    assert error_text(ValueError("half a \ud800 pair")) == "half a \\ud800 pair"
