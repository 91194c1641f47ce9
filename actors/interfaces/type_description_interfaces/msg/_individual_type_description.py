"""type_description_interfaces/msg/IndividualTypeDescription."""

from typing import Annotated

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.type_description_interfaces.msg._field import Field
from actors.interfaces.types import AtMost


class IndividualTypeDescription(
    Message, type_name="type_description_interfaces/msg/IndividualTypeDescription"
):
    """type_description_interfaces/msg/IndividualTypeDescription."""

    type_name: Annotated[str, AtMost(255)] = ""
    fields: list[Field] = msgspec.field(default_factory=list[Field])
