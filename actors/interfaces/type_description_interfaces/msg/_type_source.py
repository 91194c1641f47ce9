"""type_description_interfaces/msg/TypeSource."""

from actors.interfaces.message import Message


class TypeSource(Message, type_name="type_description_interfaces/msg/TypeSource"):
    """type_description_interfaces/msg/TypeSource."""

    type_name: str = ""
    encoding: str = ""
    raw_file_contents: str = ""
