"""A process that tries to be the broker at many places, one after the other, and says where it is.

`python racer.py PLACE…`: it waits for a line on stdin, tries, writes a line per place, and stops at the next.
"""

from __future__ import annotations

import asyncio
import sys
from contextlib import AsyncExitStack
from pathlib import Path

from broker import AddressInUseError, Broker, BrokerOptions
from proto.aio.process import new_event_loop


def _say(text: str) -> None:
    sys.stdout.write(f"{text}\n")
    sys.stdout.flush()


async def _race(places: list[str]) -> None:
    _say("ready")
    sys.stdin.readline()
    async with AsyncExitStack() as stack:
        for place in places:
            options = BrokerOptions(port=int(place)) if place.isdecimal() else BrokerOptions(unix=Path(place))
            try:
                await stack.enter_async_context(Broker(options))
            except AddressInUseError:
                _say("in use")
            else:
                _say("listens")
        await asyncio.to_thread(sys.stdin.readline)  # the loop goes on: the others ask what listens


if __name__ == "__main__":
    with asyncio.Runner(loop_factory=new_event_loop) as runner:
        runner.run(_race(sys.argv[1:]))
