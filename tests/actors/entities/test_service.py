"""Services without a broker: requests are handed in, replies are looked at before they are sent."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

import pytest

import actors
from actors.interfaces.codec import codec_for
from actors.interfaces.example_interfaces.srv import AddTwoInts
from proto.frames import RequestEntry

if TYPE_CHECKING:
    from pathlib import Path


def entry(call: int, a: int) -> RequestEntry:
    """Return a request as the broker sends it."""
    body = codec_for(AddTwoInts.Request).encode(AddTwoInts.Request(a=a))
    return RequestEntry(call, None, None, bytes(body))


@pytest.mark.parametrize("outcome", ["reply", "raise"])
async def test_a_call_whose_link_broke_is_never_answered_on_the_next(tmp_path: Path, outcome: str) -> None:
    """A handler that ends after its link broke must not answer a new call that has the same number."""
    finish, ended = asyncio.Event(), asyncio.Event()

    async def handle(request: AddTwoInts.Request) -> AddTwoInts.Response:
        try:
            await finish.wait()
        except asyncio.CancelledError:
            await finish.wait()
            ended.set()
            if outcome == "raise":
                raise ValueError("too late") from None
        return AddTwoInts.Response(sum=request.a)

    async with actors.Node("server", url=f"callboard+unix://{tmp_path}/none") as node:
        service = node.create_service(AddTwoInts, "add", handle, concurrent=True)
        service.requested((entry(1, 10),))
        await asyncio.sleep(0)
        service.link_lost()
        await asyncio.sleep(0)
        service.requested((entry(1, 20),))
        await asyncio.sleep(0)
        assert service.pending == 1
        finish.set()
        await ended.wait()
        await asyncio.sleep(0)
        assert service.served == 1
        assert node.callback_errors == (outcome == "raise")
