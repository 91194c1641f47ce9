"""Times that are filled in when a message is sent: ROS 2's `header: auto` and `stamp: now`.

    values, stamps = Stamps.taken_from(Imu, {"header": "auto"})
    message = message_from_fields(Imu, values)
    stamps.set(message, time.time_ns())

`auto` is the value of a std_msgs/msg/Header, whose stamp is set, and `now` of a builtin_interfaces/msg/Time,
anywhere in a message. `stamp_of` reads the time in a header.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, cast

from actors.interfaces.fields import fields_of
from actors.interfaces.message import Message, type_name
from actors.tools.field_paths import InvalidFieldError, value_at

if TYPE_CHECKING:
    from collections.abc import Mapping


HEADER: Final = "std_msgs/msg/Header"
TIME: Final = "builtin_interfaces/msg/Time"

Path = tuple[str | int, ...]


class Stamps:
    """The places in a message where times are filled in.

    Args:
        paths: The field names and element indices that lead to each time.

    Attributes:
        paths: As given.
    """

    def __init__(self, paths: list[Path]) -> None:
        self.paths = paths

    @classmethod
    def taken_from(cls, msg_type: type[Message], values: Mapping[str, Any]) -> tuple[dict[str, Any], Stamps]:
        """Return a message's values without `auto` and `now`, and the places of these.

        Args:
            msg_type: The message's class.
            values: The values of its fields.
        """
        paths: list[Path] = []
        return _without(msg_type, values, (), paths), cls(paths)

    def set(self, message: Message, time_ns: int) -> None:
        """Fill in a time.

        Args:
            message: The message to change.
            time_ns: Nanoseconds since the epoch; the seconds must fit an int32.
        """
        sec, nanosec = divmod(time_ns, 1_000_000_000)
        for path in self.paths:
            value: Any = message
            for step in path:
                value = value[step] if isinstance(step, int) else getattr(value, step)
            value.sec, value.nanosec = sec, nanosec


def stamp_of(message: Any) -> int | None:
    """Return the time in the header of a message, in ns since the epoch; None if it has none.

    Args:
        message: A message, or the dict of a message of unknown type.
    """
    try:
        sec, nanosec = (value_at(message, f"header.stamp.{name}") for name in ("sec", "nanosec"))
    except InvalidFieldError:
        return None
    return sec * 1_000_000_000 + nanosec if isinstance(sec, int) and isinstance(nanosec, int) else None


def _without(msg_type: type[Message], values: Any, path: Path, paths: list[Path]) -> Any:
    if not isinstance(values, dict):
        return values  # no message: populating it reports that
    types = {field.name: field.type for field in fields_of(msg_type)}
    kept: dict[str, Any] = {}
    for name, value in cast("dict[str, Any]", values).items():
        kind = types.get(name)
        nested = None if kind is None else cast("type[Message] | None", kind.message)
        if kind is None or nested is None:
            kept[name] = value
        elif not kind.is_array:
            kept[name] = _field(nested, value, (*path, name), paths)
        elif isinstance(value, list):
            items: Any = cast("Any", value)
            kept[name] = [
                _field(nested, item, (*path, name, index), paths) for index, item in enumerate(items)
            ]
        else:
            kept[name] = value
    return kept


def _field(msg_type: type[Message], value: Any, path: Path, paths: list[Path]) -> Any:
    name = type_name(msg_type)
    if value == "now" and name == TIME:
        paths.append(path)
        return {}
    if value == "auto" and name == HEADER:
        paths.append((*path, "stamp"))
        return {}
    return _without(msg_type, value, path, paths)
