"""A broker and its nodes in one program: nothing else needs to run. Ends by itself."""

import asyncio

import callboard
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import String


def add(request: AddTwoInts.Request) -> AddTwoInts.Response:
    return AddTwoInts.Response(sum=request.a + request.b)


async def main() -> None:
    async with callboard.Broker(callboard.BrokerOptions(port=0)) as hub:
        listener = callboard.Node("listener", url=hub.url)
        heard = listener.create_subscription(String, "greetings", qos_profile=10)
        listener.create_service(AddTwoInts, "add_two_ints", add)

        talker = callboard.Node("talker", url=hub.url)
        greetings = talker.create_publisher(String, "greetings", 10)
        adder = talker.create_client(AddTwoInts, "add_two_ints")

        async with listener, talker:
            await adder.wait_for_service()
            greetings.publish(String(data="hello from the same program"))
            async for msg in heard:
                print(f"heard: {msg.data}")
                break
            response = await adder.call(AddTwoInts.Request(a=5, b=3))
            print(f"5 + 3 = {response.sum}")


if __name__ == "__main__":
    asyncio.run(main())
