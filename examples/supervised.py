"""Supervision: a worker that fails is restarted, and events report it. Ends by itself.

Nothing else needs to run.
"""

import asyncio

import callboard
from actors.interfaces.std_msgs.msg import UInt32


class Counter(callboard.Node):
    """Counts down from three, and fails."""

    def __init__(self, url: str) -> None:
        super().__init__("counter", url=url, on_error="stop")
        self.publisher = self.create_publisher(UInt32, "count", 10)
        self.create_timer(0.1, self.on_timer)
        self.left = 3

    def on_timer(self) -> None:
        if self.left == 0:
            raise RuntimeError("nothing left to count")
        self.publisher.publish(UInt32(data=self.left))
        self.left -= 1


def on_count(msg: UInt32) -> None:
    print(f"heard: {msg.data}")


async def main() -> None:
    async with callboard.Broker(callboard.BrokerOptions(port=0)) as hub:
        listener = callboard.Node("listener", url=hub.url)
        listener.create_subscription(UInt32, "count", on_count)
        supervisor = callboard.Supervisor(
            [callboard.Child("counter", node=lambda: Counter(hub.url))],
            max_restarts=2,
            restart_window_sec=60.0,
        )
        events = supervisor.events()
        async with listener:
            try:
                await supervisor.run()
            except callboard.SupervisorGaveUp as error:
                print(error)
        async for event in events:
            print(f"{event.child} {event.kind.value} {event.reason}".rstrip())


if __name__ == "__main__":
    asyncio.run(main())
