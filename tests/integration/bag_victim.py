"""A recorder that kills itself under load: `python -m tests.integration.bag_victim BAG SECONDS`.

The broker, the publishers and the recorder are in this process. It prints how many messages of the recorder's
the operating system has, and kills itself so many seconds after the first of them.
"""

from __future__ import annotations

import asyncio
import os
import signal
import sys
import threading
from functools import partial

import actors
from actors.bags import Recorder, RecorderOptions, Selection
from actors.interfaces.std_msgs.msg import String
from broker import Broker, BrokerOptions

PADDING = "x" * 200
TOPICS = ("/chatter", "/rare")
RARE = 7
"""How many messages of the first topic there are for one of the second."""
KEEP_ALL = actors.QoSProfile(history=actors.HistoryPolicy.KEEP_ALL)


async def main(bag: str, seconds: float) -> None:
    """Record until the process dies."""
    options = RecorderOptions(max_bag_size=200_000, lossless=True)
    async with (
        Broker(BrokerOptions(port=0)) as broker,
        actors.Node("talker", url=broker.url) as node,
        Recorder(bag, Selection(topics=TOPICS), options, url=broker.url) as recorder,
    ):
        talker, rare = talkers = [node.create_publisher(String, name, KEEP_ALL) for name in TOPICS]
        while not all(each.get_subscription_count() for each in talkers):
            await asyncio.sleep(0)
        number = reported = 0
        while True:
            for _ in range(20):
                await talker.ready()
                talker.publish(String(data=f"{number} {PADDING}"))
                if number % RARE == 0:
                    await rare.ready()
                    rare.publish(String(data=f"{number // RARE} {PADDING}"))
                number += 1
            await asyncio.sleep(0.005)
            flushed = recorder.statistics().flushed
            if flushed != reported:
                os.write(1, b"%d\n" % flushed)
                if not reported:  # after the first line: the moment may be at once
                    threading.Timer(seconds, partial(os.kill, os.getpid(), signal.SIGKILL)).start()
                reported = flushed


if __name__ == "__main__":
    asyncio.run(main(sys.argv[1], float(sys.argv[2])))
