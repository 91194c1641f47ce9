"""A node with states, and another that brings it up and down through its services.

Beside it run `callboard broker`. Ends by itself.
"""

import asyncio

import callboard
from actors.interfaces.lifecycle_msgs.msg import Transition, TransitionEvent
from actors.interfaces.lifecycle_msgs.srv import ChangeState
from actors.interfaces.std_msgs.msg import String
from callboard import LifecycleState, TransitionCallbackReturn


class Talker(callboard.LifecycleNode):
    def __init__(self) -> None:
        super().__init__("talker")
        self.publisher = self.create_lifecycle_publisher(String, "chatter")
        self.create_timer(0.02, lambda: self.publisher.publish(String(data="hello")))

    async def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        print(f"{state.label}: opening the device")
        await asyncio.sleep(0.1)  # it takes its time
        return TransitionCallbackReturn.SUCCESS

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        raise OSError(f"the device does not answer, although it is {state.label}")

    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        print(f"{state.label}: closing the device after an error")
        return TransitionCallbackReturn.SUCCESS  # it can be configured again


async def main() -> None:
    async with Talker(), callboard.Node("manager") as manager:
        steps = manager.create_subscription(TransitionEvent, "/talker/transition_event")
        chatter = manager.create_subscription(String, "chatter")
        client = manager.create_client(ChangeState, "/talker/change_state")
        for label in ("configure", "activate", "deactivate", "cleanup"):
            request = ChangeState.Request(transition=Transition(label=label))
            done = (await client.call(request, timeout_sec=5)).success
            print(label, "succeeded" if done else "failed")
            if label == "activate":
                print("heard:", (await anext(aiter(chatter))).data)
        for _ in range(9):
            event = await anext(aiter(steps))
            print(f"{event.start_state.label} -> {event.goal_state.label}")


if __name__ == "__main__":
    callboard.run(main)
