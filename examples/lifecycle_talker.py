"""A node with states for `examples/launch/lifecycle.launch.py`: it says hello while it is active."""

import asyncio

import callboard
from actors.interfaces.std_msgs.msg import String
from callboard import LifecycleState, TransitionCallbackReturn


class Talker(callboard.LifecycleNode):
    def __init__(self) -> None:
        super().__init__("talker")
        self.publisher = self.create_lifecycle_publisher(String, "chatter")
        self.create_timer(0.1, lambda: self.publisher.publish(String(data="hello")))

    async def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        await asyncio.sleep(0.1)  # it takes its time
        self.get_logger().info(f"Configured; was {state.label}")
        return TransitionCallbackReturn.SUCCESS

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        self.get_logger().info(f"Activated; was {state.label}")
        return TransitionCallbackReturn.SUCCESS


async def main() -> None:
    async with Talker():
        await asyncio.Event().wait()


if __name__ == "__main__":
    callboard.run(main)
