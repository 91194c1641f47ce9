"""The types that cross: callboard's class and rclpy's, and what turns messages of one into the other's.

Messages cross as CDR and as msgpack. An object of rclpy becomes CDR first, by `rclpy.serialization`: rclpy
checks no ranges, so that fields copied one by one would need that here.
"""

from __future__ import annotations

import json
import re
from importlib import import_module
from typing import TYPE_CHECKING, Any, Final, NamedTuple, cast

from actors.bridges.ros2.errors import UnknownTypeError
from actors.interfaces.cdr import codec_for as cdr_codec_for
from actors.interfaces.codec import codec_for
from actors.interfaces.errors import UnknownInterfaceError
from actors.interfaces.message import Message, Service, type_hash
from actors.interfaces.registry import find_interface, installed_interface
from actors.regular_files import read_regular
from actors.tools.prefixes import package_prefix, use_ros_interfaces

if TYPE_CHECKING:
    from collections.abc import Callable

    from typing_extensions import Buffer

MAX_TYPES: Final = 4096
"""Names that are remembered, since both graphs can have any; beyond it the oldest is looked up again."""

_NAME: Final = re.compile(r"([a-z][a-z0-9_]*)/(msg|srv|action)/([A-Z][A-Za-z0-9]*)((?:_[A-Z][A-Za-z]*)*)")

_PARTS: Final[dict[str, dict[str, tuple[str, ...]]]] = {
    "msg": {},
    "srv": {"Request": ("Request",), "Response": ("Response",), "Event": ("Event",)},
    "action": {
        "Goal": ("Goal",),
        "Result": ("Result",),
        "Feedback": ("Feedback",),
        "SendGoal": ("Impl", "SendGoalService"),
        "GetResult": ("Impl", "GetResultService"),
        "FeedbackMessage": ("Impl", "FeedbackMessage"),
    },
}
"""The attributes of a class, here and in rclpy, that have the types whose names begin with its name."""
_SERVICES: Final = frozenset({"SendGoal", "GetResult"})


class TypePair(NamedTuple):
    """A type on both sides, as far as they have it; a `KnownType` for plans.

    Attributes:
        name: Its name: "std_msgs/msg/String", "pkg/action/Fibonacci_SendGoal".
        kind: "msg", "srv" or "action"; "" if the name is not that of a type.
        ours: callboard's class; None without one.
        theirs: rclpy's class; None without one.
        our_hash: The hash of callboard's class; "" without one.
        their_hash: The hash that the package in ROS 2's prefix says; "" if it does not.
        our_request_hash: For a service, the hash of its request: ROS 2's endpoints have no other.
        reason: Why it cannot cross, with the remedy; "" if it can.
    """

    name: str
    kind: str = ""
    ours: type | None = None
    theirs: type | None = None
    our_hash: str = ""
    their_hash: str = ""
    our_request_hash: str = ""
    reason: str = ""

    def difference(self, endpoint_hash: str) -> str:
        """Return why an endpoint of ROS 2 has another type of this name; "" if it has not, or nobody knows.

        Args:
            endpoint_hash: The hash in the endpoint's information: the request's for a service; "" if unknown.
        """
        own = self.our_request_hash if self.kind == "srv" else self.our_hash
        if not own or not endpoint_hash or own == endpoint_hash:
            return ""
        what = "request of the service" if self.kind == "srv" else "type"
        return f"the {what} {self.name} has the hash {own} in callboard and {endpoint_hash} in ROS 2"


class MessageTypes:
    """One message type on both sides.

    Args:
        ours: callboard's class.
        theirs: rclpy's class.

    Attributes:
        ours, theirs: As given.
    """

    __slots__ = (
        "_decode_cdr",
        "_decode_msgpack",
        "_deserialize",
        "_encode_cdr",
        "_encode_msgpack",
        "_serialize",
        "ours",
        "theirs",
    )

    def __init__(self, ours: type[Message], theirs: type) -> None:
        # Imported where rclpy is there anyway.
        serialization: Any = import_module("rclpy.serialization")
        self.ours, self.theirs = ours, theirs
        cdr, msgpack = cdr_codec_for(ours), codec_for(ours)
        self._decode_cdr: Callable[[Buffer], Message] = cdr.decode
        self._encode_cdr: Callable[[Message], bytes] = cdr.encode
        self._decode_msgpack: Callable[[Any], Message] = msgpack.decode
        self._encode_msgpack: Callable[[Message], bytes] = msgpack.encode_decoded
        self._serialize: Callable[[object], bytes] = serialization.serialize_message
        self._deserialize: Callable[[bytes, type], object] = serialization.deserialize_message

    def to_callboard(self, data: Buffer) -> bytes:
        """Return a message as msgpack.

        Args:
            data: It as CDR.

        Raises:
            InvalidMessageError: It is not a message of this type, or would take too much memory.
        """
        return self._encode_msgpack(self._decode_cdr(data))

    def to_ros(self, data: Buffer) -> bytes:
        """Return a message as CDR.

        Args:
            data: It as msgpack.

        Raises:
            InvalidMessageError: It is not a message of this type, would take too much memory, or has a value
                that ROS 2 cannot have, such as a string with a NUL.
        """
        return self._encode_cdr(self._decode_msgpack(data))

    def to_object(self, data: Buffer) -> Any:
        """Return rclpy's object of a message.

        Args:
            data: It as msgpack.

        Raises:
            InvalidMessageError: As for `to_ros`.
        """
        return self._deserialize(self.to_ros(data), self.theirs)

    def from_object(self, message: object) -> bytes:
        """Return rclpy's object of a message as msgpack.

        Args:
            message: It; its fields fit their types, as those of each received one do.

        Raises:
            InvalidMessageError: As for `to_callboard`.
        """
        return self.to_callboard(self._serialize(message))


class ServiceTypes(NamedTuple):
    """One service type on both sides."""

    ours: type[Service]
    theirs: type
    request: MessageTypes
    response: MessageTypes


class Types:
    """Finds the classes of both sides, and remembers them.

    Names come from the graphs of other machines: nothing is imported but packages that ROS 2 has installed,
    and what `find_interface` imports.
    """

    def __init__(self) -> None:
        use_ros_interfaces()
        self._known: dict[str, TypePair] = {}
        self._messages: dict[str, MessageTypes] = {}
        self._services: dict[str, ServiceTypes] = {}

    def known(self, name: str) -> TypePair:
        """Return what both sides know of a type.

        Args:
            name: Any text.
        """
        found = self._known.get(name)
        if found is None:
            if len(self._known) >= MAX_TYPES:
                self._known.pop(next(iter(self._known)))
            found = self._known[name] = _look_up(name)
        return found

    def message(self, name: str) -> MessageTypes:
        """Return the classes of a message type.

        Args:
            name: Its name.

        Raises:
            UnknownTypeError: It cannot cross.
        """
        found = self._messages.get(name)
        if found is None:
            ours, theirs = self._classes(name, "msg")
            found = self._messages[name] = MessageTypes(ours, theirs)
        return found

    def service(self, name: str) -> ServiceTypes:
        """Return the classes of a service type.

        Args:
            name: Its name.

        Raises:
            UnknownTypeError: It cannot cross.
        """
        found = self._services.get(name)
        if found is None:
            ours, theirs = self._classes(name, "srv")
            request, response = (
                MessageTypes(getattr(ours, part), getattr(theirs, part)) for part in ("Request", "Response")
            )
            found = self._services[name] = ServiceTypes(ours, theirs, request, response)
        return found

    def _classes(self, name: str, kind: str) -> tuple[Any, Any]:
        known = self.known(name)
        if known.reason:
            raise UnknownTypeError(known.reason)
        if known.kind != kind:
            raise UnknownTypeError(f"'{name}' is no {'message' if kind == 'msg' else 'service'} type")
        return known.ours, known.theirs


def _look_up(name: str) -> TypePair:
    match = _NAME.fullmatch(name)
    package, folder, base, suffix = match.groups() if match is not None else ("", "msg", "", "_")
    path, kind = _path(folder, suffix.split("_")[1:])
    if path is None:
        return TypePair(name, reason=f"{name!r} is not the name of a type, such as std_msgs/msg/String")
    whole = f"{package}/{folder}/{base}"
    theirs, reason = _theirs(package, folder, base, path)
    their_hash = _their_hash(package, folder, base, name) if theirs is not None else ""
    found = installed_interface(whole)
    try:
        # A search that fails takes 0.1 s; here it says why a definition that ROS 2 has is refused.
        if found is None and theirs is not None:
            found = find_interface(whole)
        if found is None:
            return TypePair(name, kind, reason=reason)
        ours = _part(found, path)
        request_hash = type_hash(ours.Request) if kind == "srv" else ""
        for each in (ours.Request, ours.Response) if kind == "srv" else (ours,) if kind == "msg" else ():
            cdr_codec_for(each)  # raises TypeError for names that Python does not allow
        known = TypePair(name, kind, ours, theirs, type_hash(ours), their_hash, request_hash, reason)
    except (UnknownInterfaceError, TypeError) as error:
        return TypePair(
            name, kind, None, theirs, "", their_hash, reason=reason or f"callboard cannot use {name}: {error}"
        )
    if not reason and their_hash not in {"", known.our_hash}:
        return known._replace(
            reason=f"{name} has the hash {known.our_hash} in callboard and {their_hash} in ROS 2: install"
            f" versions of {package} with the same definition"
        )
    return known


def _path(folder: str, parts: list[str]) -> tuple[list[str] | None, str]:
    """Return the attributes that lead to a part of a service or action, and the part's kind."""
    path: list[str] = []
    kind = folder
    for each in parts:
        attributes = _PARTS[kind].get(each)
        if attributes is None:
            return None, ""
        path += attributes
        kind = "srv" if each in _SERVICES else "msg"
    return path, kind


def _part(cls: Any, path: list[str]) -> Any:
    for each in path:
        cls = getattr(cls, each)
    return cls


def _theirs(package: str, folder: str, base: str, path: list[str]) -> tuple[type | None, str]:
    """Return rclpy's class of a type, or why there is none."""
    if package_prefix(package) is None:
        dashed = package.replace("_", "-")
        return None, (
            f"ROS 2 has no package {package}: install it (apt: ros-DISTRO-{dashed}, pip: ros-{dashed}), or"
            " source the workspace that has it"
        )
    try:
        module = import_module(f"{package}.{folder}")
        whole: Any = getattr(module, base, None)
        if whole is None:
            return None, f"the package {package} of ROS 2 has no {folder}/{base}: install another version"
        cls = _part(whole, path)
        if cls._TYPE_SUPPORT is None:
            cast("Any", type(cls)).__import_type_support__()
    except Exception as error:  # noqa: BLE001 - of the package's own code, also rosidl's UnsupportedTypeSupport
        return None, f"the package {package} of ROS 2 cannot be imported: {error}"
    if cls._TYPE_SUPPORT is None:
        return None, f"{package}/{folder}/{base} has no type support for this ROS 2: build {package} again"
    return cls, ""


def _their_hash(package: str, folder: str, base: str, name: str) -> str:
    """Return the hash of a type, as ROS 2 has it since Iron beside the text of the definition."""
    prefix = package_prefix(package)
    if prefix is None:
        return ""
    try:
        found = json.loads(read_regular(prefix / "share" / package / folder / f"{base}.json"))
        return next((each["hash_string"] for each in found["type_hashes"] if each["type_name"] == name), "")
    except (OSError, ValueError, LookupError, TypeError):
        return ""
