"""test_msgs/msg/Strings."""

from typing import Annotated, ClassVar

from actors.interfaces.message import Message
from actors.interfaces.types import AtMost


class Strings(Message, type_name="test_msgs/msg/Strings"):
    """test_msgs/msg/Strings."""

    STRING_CONST: ClassVar[str] = "Hello world!"

    string_value: str = ""
    string_value_default1: str = "Hello world!"
    string_value_default2: str = "Hello'world!"
    string_value_default3: str = 'Hello"world!'
    string_value_default4: str = "Hello'world!"
    string_value_default5: str = 'Hello"world!'
    string_value_default6: str = "Hello\\world!"
    string_value_default7: str = "Hello\tworld!"
    bounded_string_value: Annotated[str, AtMost(22)] = ""
    bounded_string_value_default1: Annotated[str, AtMost(22)] = "Hello world!"
    bounded_string_value_default2: Annotated[str, AtMost(22)] = "Hello'world!"
    bounded_string_value_default3: Annotated[str, AtMost(22)] = 'Hello"world!'
    bounded_string_value_default4: Annotated[str, AtMost(22)] = "Hello'world!"
    bounded_string_value_default5: Annotated[str, AtMost(22)] = 'Hello"world!'
    bounded_string_value_default6: Annotated[str, AtMost(22)] = "Hello\\world!"
    bounded_string_value_default7: Annotated[str, AtMost(22)] = "Hello\tworld!"
