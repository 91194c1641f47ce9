"""Serve `add_two_ints`: the sum of two integers.

Beside it run `callboard broker` and `python examples/add_two_ints_client.py 5 3`. A sum that does not fit in
an int64 is never sent: the reply is checked, and the client gets the error.
"""

import callboard
from actors.interfaces.example_interfaces.srv import AddTwoInts


class AddTwoIntsServer(callboard.Node):
    def __init__(self) -> None:
        super().__init__("add_two_ints_server")
        self.create_service(AddTwoInts, "add_two_ints", self.on_request)
        self.get_logger().info("Ready to add two ints.")

    def on_request(self, request: AddTwoInts.Request, response: AddTwoInts.Response) -> AddTwoInts.Response:
        self.get_logger().info(f"Incoming request\na: {request.a} b: {request.b}")
        response.sum = request.a + request.b
        self.get_logger().info(f"sending back response: [{response.sum}]")
        return response


if __name__ == "__main__":
    callboard.run(AddTwoIntsServer)
