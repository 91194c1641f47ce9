"""Byte-level cases (`bytes/*.json`): only the connection at fault closes, with the stated reason."""

from __future__ import annotations

import asyncio
import json
from typing import TYPE_CHECKING

import pytest

from broker import Broker, BrokerOptions
from proto import limits
from proto.errors import ErrorCode
from proto.wire import frames
from proto.wire.codec import encode
from tests.broker.rawclient import link, read_error, read_frame, stream, until
from tests.hostile import generate

if TYPE_CHECKING:
    from typing import Any

PING = frames.Ping(77)


def test_the_files_are_up_to_date() -> None:
    """`python -m tests.hostile.generate` would change nothing, and there is no other file."""
    files = {file.stem: file.read_text(encoding="utf-8") for file in generate.DIRECTORY.iterdir()}
    expected = {name: generate.render(name) for name in generate.FILES}
    assert files == expected, "run python -m tests.hostile.generate"


@pytest.mark.parametrize("name", generate.FILES)
async def test_only_the_guilty_connection_closes(name: str) -> None:
    """The cases that the files name: each gets its answer; a bystander is not touched."""
    content = json.loads((generate.DIRECTORY / f"{name}.json").read_text(encoding="utf-8"))
    wrong: list[str] = []
    options = BrokerOptions(port=0, drain_timeout_sec=0.2)
    async with Broker(options) as broker, link(broker, "/bystander") as bystander:
        for case in content["cases"]:
            answer = await play(broker, case, content["states"][case["state"]])
            if answer != case["expect"]:
                wrong.append(f"{case['name']}: {answer}, not {case['expect']}")
            await bystander.synchronise()
        await until(lambda: broker.stats().connections == 1)
        assert bystander.problem is None
        assert broker.stats().endpoints == 1
    assert wrong == []


async def play(broker: Broker, case: dict[str, Any], state: list[str]) -> str:
    """Send what a case sends; return what comes back, in the words of the files."""
    publisher = 0
    async with stream(broker) as (reader, writer):
        for step in state:
            writer.write(generate.from_text(step) + (encode(PING) if step is not state[0] else b""))
            while not isinstance(got := await read_frame(reader), frames.Welcome | frames.Pong):
                if isinstance(got, frames.Accepted) and got.id == 1:
                    publisher = got.number
        writer.write(generate.from_text(case["send"], publisher))
        expect: str = case["expect"]
        if expect == "closed" or expect.startswith("ERROR"):
            return name_of(await read_error(reader))
        if state:
            writer.write(encode(PING))
        return await survived(reader)


async def survived(reader: asyncio.StreamReader) -> str:
    """Read until PONG or WELCOME; return whether a declaration was refused."""
    answer = "open"
    try:
        while True:
            got = await read_frame(reader)
            if isinstance(got, frames.Refused):
                answer = f"REFUSED {ErrorCode(got.code).name}"
            elif isinstance(got, frames.Error):
                return name_of(got)
            elif isinstance(got, frames.Welcome):
                return "welcome"
            elif isinstance(got, frames.Pong):
                return answer
    except asyncio.IncompleteReadError:
        return "closed"


def name_of(error: frames.Error | None) -> str:
    """Return what ended a connection; the text must be fit for a terminal."""
    if error is None:
        return "closed"
    assert error.text.isprintable()
    assert len(error.text) <= limits.MAX_ERROR_TEXT
    return f"ERROR {ErrorCode(error.code).name}"
