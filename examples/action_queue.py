"""An action server that queues goals: accepted at once, executed one after the other. Ends by itself.

Beside it run `callboard broker`.
"""

import asyncio
from collections import deque
from typing import Any

import callboard
from actors.interfaces.example_interfaces.action import Fibonacci

Goal = callboard.ServerGoalHandle[Any, Any, Any]


class Queue(callboard.Node):
    def __init__(self) -> None:
        super().__init__("queue")
        self.waiting: deque[Goal] = deque()
        self.busy = False
        self.create_action_server(
            Fibonacci, "fibonacci", self.execute, handle_accepted_callback=self.on_accepted
        )

    def on_accepted(self, goal: Goal) -> None:
        self.waiting.append(goal)
        self.execute_next()

    def execute_next(self) -> None:
        if self.waiting and not self.busy:
            self.busy = True
            self.waiting.popleft().execute()

    async def execute(self, goal: Goal) -> Fibonacci.Result:
        print(f"executing order {goal.request.order}, {len(self.waiting)} more wait")
        try:
            await asyncio.sleep(0.1)
            goal.succeed()
            return Fibonacci.Result(sequence=list(range(goal.request.order)))
        finally:
            self.busy = False
            self.execute_next()


async def main() -> None:
    async with Queue(), callboard.Node("client") as node:
        client = node.create_action_client(Fibonacci, "fibonacci")
        await client.wait_for_server()
        handles = [await client.send_goal(Fibonacci.Goal(order=order)) for order in (1, 2, 3)]
        for handle in handles:
            status, result = await handle.result()
            print(status.name, len(result.sequence))


if __name__ == "__main__":
    callboard.run(main)
