"""Send a goal to `fibonacci` and print its feedback: `python examples/fibonacci_action_client.py 5`.

Beside it run `callboard broker` and `python examples/fibonacci_action_server.py`, in any order. Ctrl-C
cancels the goal.
"""

import asyncio
import sys

import callboard
from actors.interfaces.example_interfaces.action import Fibonacci


async def main() -> int:
    order = int(callboard.parse_ros_arguments(sys.argv[1:]).remaining[0])
    async with callboard.Node("fibonacci_action_client") as node:
        client = node.create_action_client(Fibonacci, "fibonacci")
        while not await client.wait_for_server(timeout_sec=5.0):
            node.get_logger().info("action server not available, waiting again...")
        handle = await client.send_goal(Fibonacci.Goal(order=order))
        if not handle.accepted:
            print("the goal was rejected")
            return 1
        try:
            async for feedback in handle:
                print("feedback:", *feedback.sequence)
            status, result = await handle.result()
        except asyncio.CancelledError:
            await handle.cancel(timeout_sec=1.0)
            raise
        except callboard.CallFailed as error:
            print(f"no result: {error}")
            return 1
        print(f"{status.name}:", *result.sequence)
    return 0


if __name__ == "__main__":
    sys.exit(callboard.run(main))
