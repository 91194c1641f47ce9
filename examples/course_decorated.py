"""The course's five programs with decorators, all at once; run `callboard broker` beside it."""

import callboard
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import String


class MinimalPublisher(callboard.Node):
    def __init__(self) -> None:
        super().__init__("minimal_publisher")
        self.publisher = self.create_publisher(String, "addison", 10)
        self.i = 0

    @callboard.timer(0.5)
    def on_timer(self) -> None:
        msg = String(data=f"Hi Automatic Addison: {self.i}")
        self.publisher.publish(msg)
        self.get_logger().info(f'Publishing: "{msg.data}"')
        self.i += 1


class MinimalSubscriber(callboard.Node):
    def __init__(self) -> None:
        super().__init__("minimal_subscriber")

    @callboard.subscription(String, "addison", 10)
    def on_message(self, msg: String) -> None:
        self.get_logger().info(f'I heard: "{msg.data}"')


class PublishingSubscriber(callboard.Node):
    def __init__(self) -> None:
        super().__init__("publishing_subscriber")
        self.publisher = self.create_publisher(String, "addison2", 10)

    @callboard.subscription(String, "addison", 10)
    def on_message(self, msg: String) -> None:
        reply = String(data=f"I heard {msg.data}")
        self.publisher.publish(reply)
        self.get_logger().info(f'Publishing: "{reply.data}"')


class AddTwoIntsServer(callboard.Node):
    def __init__(self) -> None:
        super().__init__("add_two_ints_server")
        self.get_logger().info("Ready to add two ints.")

    @callboard.service(AddTwoInts, "add_two_ints")
    def on_request(self, request: AddTwoInts.Request, response: AddTwoInts.Response) -> AddTwoInts.Response:
        response.sum = request.a + request.b
        self.get_logger().info(f"Incoming request\na: {request.a} b: {request.b}")
        self.get_logger().info(f"sending back response: [{response.sum}]")
        return response


class AddTwoIntsClient(callboard.Node):
    def __init__(self) -> None:
        super().__init__("add_two_ints_client")
        self.client = self.create_client(AddTwoInts, "add_two_ints")

    @callboard.timer(1.0)
    async def on_timer(self) -> None:
        while not await self.client.wait_for_service(timeout_sec=1.0):
            self.get_logger().info("service not available, waiting again...")
        try:
            response = await self.client.call(AddTwoInts.Request(a=5, b=3))
            self.get_logger().info(f"Sum: {response.sum}")
        except callboard.CallFailed as error:
            self.get_logger().error(f"Failed to call service add_two_ints: {error}")


if __name__ == "__main__":
    callboard.run(
        MinimalPublisher, MinimalSubscriber, PublishingSubscriber, AddTwoIntsServer, AddTwoIntsClient
    )
