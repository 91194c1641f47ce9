"""test_msgs/msg/WStrings."""

from typing import Annotated

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.types import AtMost, Length, wstring


class WStrings(Message, type_name="test_msgs/msg/WStrings"):
    """test_msgs/msg/WStrings."""

    wstring_value: wstring = ""
    wstring_value_default1: wstring = "Hello world!"
    wstring_value_default2: wstring = "Hellö wörld!"
    wstring_value_default3: wstring = "ハローワールド"
    array_of_wstrings: Annotated[list[wstring], Length(3)] = msgspec.field(default_factory=lambda: [""] * 3)
    bounded_sequence_of_wstrings: Annotated[list[wstring], AtMost(3)] = msgspec.field(
        default_factory=list[wstring]
    )
    unbounded_sequence_of_wstrings: list[wstring] = msgspec.field(default_factory=list[wstring])
