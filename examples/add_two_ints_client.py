"""Ask `add_two_ints` for the sum of X and Y: `python examples/add_two_ints_client.py 5 3`.

Beside it run `callboard broker` and `python examples/add_two_ints_server.py`, in any order.
"""

import sys

import callboard
from actors.interfaces.example_interfaces.srv import AddTwoInts


class AddTwoIntsClient(callboard.Node):
    def __init__(self) -> None:
        super().__init__("add_two_ints_client")
        self.client = self.create_client(AddTwoInts, "add_two_ints")

    async def add(self, a: int, b: int) -> int:
        while not await self.client.wait_for_service(timeout_sec=1.0):
            self.get_logger().info("service not available, waiting again...")
        response = await self.client.call(AddTwoInts.Request(a=a, b=b))
        return response.sum


async def main() -> int:
    try:
        a, b = map(int, callboard.parse_ros_arguments(sys.argv[1:]).remaining)
    except ValueError:
        print("usage: add_two_ints_client X Y", file=sys.stderr)
        return 1
    async with AddTwoIntsClient() as node:
        try:
            node.get_logger().info(f"Sum: {await node.add(a, b)}")
        except (callboard.CallFailed, callboard.InvalidMessageError) as error:
            node.get_logger().error(f"Failed to call service add_two_ints: {error}")
            return 1
    return 0


if __name__ == "__main__":
    status = callboard.run(main)
    if status is None:  # SIGINT or SIGTERM
        callboard.get_logger("add_two_ints_client").info(
            "Interrupted while waiting for the service. Exiting."
        )
    sys.exit(status)
