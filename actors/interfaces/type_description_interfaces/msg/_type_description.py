"""type_description_interfaces/msg/TypeDescription."""

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.type_description_interfaces.msg._individual_type_description import (
    IndividualTypeDescription,
)


class TypeDescription(Message, type_name="type_description_interfaces/msg/TypeDescription"):
    """type_description_interfaces/msg/TypeDescription."""

    type_description: IndividualTypeDescription = msgspec.field(default_factory=IndividualTypeDescription)
    referenced_type_descriptions: list[IndividualTypeDescription] = msgspec.field(
        default_factory=list[IndividualTypeDescription]
    )
