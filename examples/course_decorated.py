"""The course's five programs with decorators, all at once; run `callboard broker` beside it."""

import actors
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import String


class MinimalPublisher(actors.Node):
    def __init__(self) -> None:
        super().__init__("minimal_publisher")
        self.publisher = self.create_publisher(String, "addison", 10)
        self.i = 0

    @actors.timer(0.5)
    def on_timer(self) -> None:
        self.publisher.publish(msg := String(data=f"Hi Automatic Addison: {self.i}"))
        self.get_logger().info(f'Publishing: "{msg.data}"')
        self.i += 1


class MinimalSubscriber(actors.Node):
    @actors.subscription(String, "addison", 10)
    def on_message(self, msg: String) -> None:
        self.get_logger().info(f'I heard: "{msg.data}"')


class PublishingSubscriber(actors.Node):
    def __init__(self) -> None:
        super().__init__("publishing_subscriber")
        self.publisher = self.create_publisher(String, "addison2", 10)

    @actors.subscription(String, "addison", 10)
    def on_message(self, msg: String) -> None:
        self.publisher.publish(String(data=f"I heard {msg.data}"))


class AddTwoIntsServer(actors.Node):
    @actors.service(AddTwoInts, "add_two_ints")
    def on_request(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
        self.get_logger().info(f"Incoming request\na: {request.a} b: {request.b}")
        return AddTwoInts.Response(sum=request.a + request.b)


class AddTwoIntsClient(actors.Node):
    @actors.timer(1.0)
    async def on_timer(self) -> None:
        client = self.create_client(AddTwoInts, "add_two_ints")
        await client.wait_for_service()
        self.get_logger().info(f"Sum: {(await client.call(AddTwoInts.Request(a=5, b=3))).sum}")
        self.destroy_client(client)


if __name__ == "__main__":
    actors.run(
        MinimalPublisher,
        PublishingSubscriber,
        lambda: MinimalSubscriber("minimal_subscriber"),
        lambda: AddTwoIntsServer("add_two_ints_server"),
        lambda: AddTwoIntsClient("add_two_ints_client"),
    )
