"""Messages to YAML, CSV and dicts."""

from __future__ import annotations

from collections import OrderedDict
from typing import TYPE_CHECKING

from actors.interfaces.convert import message_to_csv as message_to_csv
from actors.interfaces.convert import message_to_ordereddict as message_to_ordereddict
from actors.interfaces.convert import message_to_yaml as message_to_yaml

if TYPE_CHECKING:
    from actors.interfaces.message import Message
    from actors.interfaces.slot_types import AbstractType


def get_message_slot_types(msg: Message) -> OrderedDict[str, AbstractType]:
    """Return the names and the types of a message's fields in order."""
    return OrderedDict(zip(msg.get_fields_and_field_types(), msg.SLOT_TYPES, strict=True))
