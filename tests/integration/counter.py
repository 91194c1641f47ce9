"""A program that counts what it hears, and can be blocked: the other side of many tests of faults."""

from __future__ import annotations

from typing import NamedTuple, Self

COUNTER = """
import sys, time
import actors
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import Int64

class Counter(actors.Node):
    def __init__(self):
        super().__init__("counter")
        self.last = -1
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
        time.sleep(request.a / 1000)
        response.sum = request.a
        return response

actors.run(Counter)
"""
"""Hears KEEP_ALL on `numbers`, which must rise; at a negative one it says what it has counted.
Serves `block`, which stands still for `a` ms."""


class Counted(NamedTuple):
    """What the counter says of its subscription."""

    received: int
    lost: int
    """Dropped at its side, or never sent over an unbroken link."""
    lost_on_break: int

    @classmethod
    def read(cls, line: str) -> Self:
        """Read the line that starts with "counted"."""
        return cls(*map(int, line.split()[1:]))
