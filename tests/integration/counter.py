"""A program that counts the messages it receives and can be blocked, for tests of faults."""

from __future__ import annotations

from typing import NamedTuple, Self

COUNTER = """
import signal, time
import actors
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import Int64

class Counter(actors.Node):
    def __init__(self):
        super().__init__("counter")
        self.last = -1
        signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGUSR1])  # so that block() can wait for it
        qos = actors.QoSProfile(history=actors.HistoryPolicy.KEEP_ALL)
        self.subscription = self.create_subscription(Int64, "numbers", self.on_number, qos)
        self.create_service(AddTwoInts, "block", self.block)
        print("up", flush=True)

    def on_number(self, msg):
        assert abs(msg.data) > self.last, (msg.data, self.last)
        self.last = abs(msg.data)
        if msg.data < 0:
            sub = self.subscription
            print("counted", sub.received, sub.dropped + sub.lost, sub.lost_on_break, flush=True)

    def block(self, request, response):
        print("blocking", flush=True)
        if request.a < 0:
            signal.sigwait([signal.SIGUSR1])
        else:
            time.sleep(request.a / 1000)
        response.sum = request.a
        return response

actors.run(Counter)
"""
"""Subscribes with KEEP_ALL to `numbers`, which must rise; at a negative number it prints its counters.
Serves `block`, which blocks the loop for `a` ms, or, if `a` is negative, until SIGUSR1."""


class Counted(NamedTuple):
    """Counters of the subscription."""

    received: int
    lost: int
    """Dropped by the subscription, or never sent although the connection held."""
    lost_on_break: int

    @classmethod
    def read(cls, line: str) -> Self:
        """Read the line that starts with "counted"."""
        return cls(*map(int, line.split()[1:]))
