"""Serve the action `fibonacci`: goals run concurrently, report each step, and can be cancelled.

Beside it run `callboard broker` and `python examples/fibonacci_action_client.py 5`, or
`callboard action send_goal --feedback /fibonacci example_interfaces/action/Fibonacci '{order: 5}'`.
"""

import asyncio

import callboard
from actors.interfaces.example_interfaces.action import Fibonacci
from callboard import CancelResponse, GoalResponse

FibonacciGoal = callboard.ServerGoalHandle[Fibonacci.Goal, Fibonacci.Result, Fibonacci.Feedback]


class FibonacciActionServer(callboard.Node):
    def __init__(self) -> None:
        super().__init__("fibonacci_action_server")
        self.create_action_server(
            Fibonacci,
            "fibonacci",
            self.execute,
            goal_callback=self.on_goal,
            cancel_callback=self.on_cancel,
        )
        self.get_logger().info("Ready for goals.")

    def on_goal(self, goal: Fibonacci.Goal) -> GoalResponse:
        return GoalResponse.ACCEPT if 0 <= goal.order <= 45 else GoalResponse.REJECT

    def on_cancel(self, goal: FibonacciGoal) -> CancelResponse:
        self.get_logger().info(f"Canceling a goal of order {goal.request.order}")
        return CancelResponse.ACCEPT

    async def execute(self, goal: FibonacciGoal) -> Fibonacci.Result:
        self.get_logger().info(f"Executing a goal of order {goal.request.order}")
        sequence = [0, 1]
        for _ in range(goal.request.order):
            await asyncio.sleep(0.2)
            if goal.is_cancel_requested:
                goal.canceled()
                return Fibonacci.Result(sequence=sequence)
            sequence.append(sequence[-1] + sequence[-2])
            goal.publish_feedback(Fibonacci.Feedback(sequence=sequence))
        goal.succeed()
        return Fibonacci.Result(sequence=sequence)


if __name__ == "__main__":
    callboard.run(FibonacciActionServer)
