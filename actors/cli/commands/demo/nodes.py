"""The demo's nodes. Each would run as well in a process of its own: see examples/."""

from __future__ import annotations

import asyncio
import time

import actors
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import String


class AddTwoIntsServer(actors.Node):
    """Serves the sum of two numbers."""

    def __init__(self, url: str) -> None:
        super().__init__("add_two_ints_server", url=url)
        self.service = self.create_service(AddTwoInts, "add_two_ints", self.on_request)

    def on_request(self, request: AddTwoInts.Request, response: AddTwoInts.Response) -> AddTwoInts.Response:
        """Answer one request."""
        response.sum = request.a + request.b
        self.get_logger().info(f"Incoming request: {request.a} + {request.b}")
        return response


class AddTwoIntsClient(actors.Node):
    """Asks for sums, and notes how long each answer took."""

    def __init__(self, url: str) -> None:
        super().__init__("add_two_ints_client", url=url)
        self.client = self.create_client(AddTwoInts, "add_two_ints")
        self.call_seconds: list[float] = []

    async def add(self, a: int, b: int) -> int:
        """Ask once."""
        start = time.perf_counter()
        response = await self.client.call(AddTwoInts.Request(a=a, b=b))
        self.call_seconds.append(time.perf_counter() - start)
        return response.sum

    async def ask_again_and_again(self) -> None:
        """Wait for the service, then ask twice a second."""
        while not await self.client.wait_for_service(timeout_sec=1.0):
            self.get_logger().info("service not available, waiting again...")
        b = 3
        while True:
            self.get_logger().info(f"Sum: {await self.add(5, b)}")
            b += 1
            await asyncio.sleep(0.5)


class MinimalPublisher(actors.Node):
    """Says something twice a second."""

    def __init__(self, url: str) -> None:
        super().__init__("minimal_publisher", url=url)
        self.publisher = self.create_publisher(String, "addison", 10)
        self.create_timer(0.5, self.on_timer)
        self.i = 0

    def on_timer(self) -> None:
        """Say it."""
        msg = String(data=f"Hi Automatic Addison: {self.i}")
        self.publisher.publish(msg)
        self.get_logger().info(f'Publishing: "{msg.data}"')
        self.i += 1


class MinimalSubscriber(actors.Node):
    """Hears it."""

    def __init__(self, url: str) -> None:
        super().__init__("minimal_subscriber", url=url)
        self.subscription = self.create_subscription(String, "addison", self.on_message, 10)

    def on_message(self, msg: String) -> None:
        """Log one message."""
        self.get_logger().info(f'I heard: "{msg.data}"')


class PublishingSubscriber(actors.Node):
    """Hears it, too, and says so on another topic."""

    def __init__(self, url: str) -> None:
        super().__init__("publishing_subscriber", url=url)
        self.subscription = self.create_subscription(String, "addison", self.on_message, 10)
        self.publisher = self.create_publisher(String, "addison2", 10)

    def on_message(self, msg: String) -> None:
        """Repeat one message."""
        heard = String(data=f"I heard {msg.data}")
        self.publisher.publish(heard)
        self.get_logger().info(heard.data)
