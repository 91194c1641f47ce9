"""Nodes for the verbs of ros2cli: topics, a service, an action, parameters and states."""

from __future__ import annotations

import asyncio
from typing import Any

import actors
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.geometry_msgs.msg import PointStamped
from actors.interfaces.std_msgs.msg import String


class Robot(actors.LifecycleNode):
    """Publishes, and serves what its name says."""

    def __init__(self) -> None:
        super().__init__("robot")
        self.declare_parameter("speed", 0.5)
        points = self.create_publisher(PointStamped, "points")
        self.create_timer(0.1, lambda: points.publish(self._point()))
        server = self.create_service(AddTwoInts, "add_two_ints", self._add)
        server.configure_introspection(self.get_clock(), 10, actors.ServiceIntrospectionState.CONTENTS)
        self._client = self.create_client(AddTwoInts, "add_two_ints")
        self.create_timer(0.2, self._call)
        self.create_action_server(Fibonacci, "fibonacci", self._fibonacci)
        self.create_subscription(String, "words", lambda message: print("heard", message.data, flush=True))

    def _point(self) -> PointStamped:
        point = PointStamped()
        point.header.stamp = self.get_clock().now().to_msg()
        return point

    def _add(self, request: AddTwoInts.Request, response: AddTwoInts.Response) -> AddTwoInts.Response:
        response.sum = request.a + request.b
        return response

    async def _call(self) -> None:
        if self._client.service_is_ready():
            await self._client.call(AddTwoInts.Request(a=2, b=2))

    async def _fibonacci(self, goal: Any) -> Fibonacci.Result:
        goal.publish_feedback(Fibonacci.Feedback(sequence=[0, 1, 1]))
        await asyncio.sleep(0)
        goal.succeed()
        return Fibonacci.Result(sequence=[0, 1, 1, 2])


async def main() -> None:
    """Say when everything is there."""
    async with Robot():
        print("ready", flush=True)
        await asyncio.Event().wait()


if __name__ == "__main__":
    actors.run(main)
