"""example_interfaces/srv/AddTwoInts."""

from actors.interfaces.message import Message, Service
from actors.interfaces.types import int64


class AddTwoInts(Service, type_name="example_interfaces/srv/AddTwoInts"):
    """example_interfaces/srv/AddTwoInts."""

    class Request(Message):
        """The request."""

        a: int64 = 0
        b: int64 = 0

    class Response(Message):
        """The response."""

        sum: int64 = 0
