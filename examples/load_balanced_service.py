"""Three servers of one service share the requests: each goes to the server with the fewest pending.

Beside it run `callboard broker`. Ends by itself and prints how many requests each server answered.
"""

import asyncio
from contextlib import AsyncExitStack

import callboard
from actors.interfaces.example_interfaces.srv import AddTwoInts

SERVERS = 3
REQUESTS = 30


class Worker(callboard.Node):
    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.answered = 0
        self.create_service(AddTwoInts, "shared_sum", self.on_request)

    async def on_request(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
        await asyncio.sleep(0.01)  # work
        self.answered += 1
        return AddTwoInts.Response(sum=request.a + request.b)


async def main() -> None:
    workers = [Worker(f"worker_{i}") for i in range(SERVERS)]
    boss = callboard.Node("boss")
    client = boss.create_client(AddTwoInts, "shared_sum")
    async with AsyncExitStack() as stack:
        for node in (*workers, boss):
            await stack.enter_async_context(node)
        for worker in workers:
            await boss.wait_for_node(worker.get_fully_qualified_name())
        calls = [client.call(AddTwoInts.Request(a=i, b=i)) for i in range(REQUESTS)]
        responses = await asyncio.gather(*calls)
        assert [response.sum for response in responses] == [2 * i for i in range(REQUESTS)]
    for worker in workers:
        print(f"{worker.get_name()} answered {worker.answered} of {REQUESTS} requests")


if __name__ == "__main__":
    callboard.run(main)
