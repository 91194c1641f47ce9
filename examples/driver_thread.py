"""A program without asyncio: a driver calls back in its own thread, the main thread receives and calls.

Start `callboard broker` first. Ends by itself.
"""

import threading
from collections.abc import Callable

import callboard
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import Int64
from actors.threads import NodeThread


class Driver(threading.Thread):
    """Stands for the driver of a device."""

    def __init__(self, on_ticks: Callable[[int], None]) -> None:
        super().__init__()
        self.on_ticks = on_ticks

    def run(self) -> None:
        for ticks in range(1, 1001):
            self.on_ticks(ticks)


class Robot(callboard.Node):
    def __init__(self) -> None:
        super().__init__("robot")
        self.ticks = self.create_publisher(Int64, "ticks", 1000)
        self.received = self.create_subscription(Int64, "ticks", qos_profile=1000)
        self.create_service(AddTwoInts, "add_two_ints", self.add)
        self.adder = self.create_client(AddTwoInts, "add_two_ints")

    def add(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
        return AddTwoInts.Response(sum=request.a + request.b)


def main() -> None:
    with NodeThread() as thread:
        robot = thread.enter(Robot())
        thread.call(robot.ticks.wait_for_subscriptions)
        ticks = thread.publisher(robot.ticks)
        arrived = threading.Event()
        thread.call(lambda: robot.received.set_on_ready(arrived.set))
        driver = Driver(lambda number: ticks.publish(Int64(data=number)))
        driver.start()
        last = 0
        while last < 1000 and arrived.wait(10):
            arrived.clear()
            while (taken := robot.received.take()) is not None:
                last = taken[0].data
        print(f"ticks: {last}, {ticks.published} published, {ticks.dropped} dropped")
        thread.call(robot.adder.wait_for_service)
        response = thread.call(robot.adder.call(AddTwoInts.Request(a=last, b=1), timeout_sec=5))
        print(f"{last} + 1 = {response.sum}")


if __name__ == "__main__":
    main()
