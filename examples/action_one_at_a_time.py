"""An action server with one goal at a time: a new goal aborts the one before it. Ends by itself.

Beside it run `callboard broker`.
"""

import asyncio
from typing import Any

import callboard
from actors.interfaces.example_interfaces.action import Fibonacci

Goal = callboard.ServerGoalHandle[Any, Any, Any]


class OneAtATime(callboard.Node):
    def __init__(self) -> None:
        super().__init__("one_at_a_time")
        self.current: Goal | None = None
        self.create_action_server(
            Fibonacci, "fibonacci", self.execute, handle_accepted_callback=self.on_accepted
        )

    def on_accepted(self, goal: Goal) -> None:
        if self.current is not None and self.current.is_active:
            self.current.abort()
        self.current = goal
        goal.execute()

    async def execute(self, goal: Goal) -> Fibonacci.Result:
        sequence = [0, 1]
        while goal.is_active and len(sequence) < goal.request.order:
            sequence.append(sequence[-1] + sequence[-2])
            await asyncio.sleep(0.1)
        if goal.is_active:
            goal.succeed()
        return Fibonacci.Result(sequence=sequence)


async def main() -> None:
    async with OneAtATime(), callboard.Node("client") as node:
        client = node.create_action_client(Fibonacci, "fibonacci")
        await client.wait_for_server()
        first = await client.send_goal(Fibonacci.Goal(order=40))
        second = await client.send_goal(Fibonacci.Goal(order=5))
        print("first:", (await first.result()).status.name)
        print("second:", (await second.result()).status.name)


if __name__ == "__main__":
    callboard.run(main)
