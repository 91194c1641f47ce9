"""type_description_interfaces/msg/Field."""

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.type_description_interfaces.msg._field_type import FieldType


class Field(Message, type_name="type_description_interfaces/msg/Field"):
    """type_description_interfaces/msg/Field."""

    name: str = ""
    type: FieldType = msgspec.field(default_factory=FieldType)
    default_value: str = ""
