"""Subscriptions, services and timers declared on the methods that handle them.

class Listener(actors.Node):
    @actors.subscription(String, "addison", 10)
    def on_message(self, msg: String) -> None:
        ...
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any, Final, Protocol, TypeVar

from actors.qos.profile import renamed_qos

if TYPE_CHECKING:
    from actors.interfaces.message import Message, ServiceType
    from actors.qos.profile import QoSProfile

_MARKS: Final = "__callboard_declarations__"

F = TypeVar("F", bound=Callable[..., Any])


class Declaring(Protocol):
    """The part of Node that declarations use. A protocol, because the node imports this module."""

    def create_subscription(
        self,
        msg_type: type[Message],
        topic: str,
        callback: Callable[..., Any],
        qos: QoSProfile | int,
        /,
        *,
        concurrent: bool,
        raw: bool,
    ) -> object:
        """Create a subscription with the method as its callback."""
        ...

    @property
    def create_service(self) -> Callable[..., object]:
        """Creates a service with the method as its callback. Its overloads depend on `raw`."""
        ...

    def create_timer(self, period_sec: float, callback: Callable[..., Any], /) -> object:
        """Create a timer with the method as its callback."""
        ...


Declaration = Callable[[Declaring, Callable[..., Any]], object]


def _mark(declare: Declaration) -> Callable[[F], F]:
    def decorate(method: F) -> F:
        # A new list, not an appended one: the method may be in use under another name, with declarations of
        # its own.
        setattr(method, _MARKS, [*getattr(method, _MARKS, []), declare])
        return method

    return decorate


def subscription(
    msg_type: type[Message],
    topic: str,
    qos_profile: QoSProfile | int = 10,
    *,
    qos: QoSProfile | int | None = None,
    concurrent: bool = False,
    raw: bool = False,
) -> Callable[[F], F]:
    """Make the method the callback of a subscription.

    Args:
        msg_type: A message class.
        topic: Relative to the namespace, absolute with `/`, private with `~/`.
        qos_profile: A profile, or a depth, which means KEEP_LAST of that depth.
        qos: The former name of `qos_profile`.
        concurrent: Do not wait for the node's other callbacks, nor for this one.
        raw: Give each message as bytes (msgpack), and match publishers of every type.

    Returns:
        The decorator; the method stays as it is.
    """
    profile = qos_profile if qos is None else renamed_qos(qos)
    return _mark(
        lambda node, callback: node.create_subscription(
            msg_type, topic, callback, profile, concurrent=concurrent, raw=raw
        )
    )


def service(
    srv_type: type[ServiceType[Any, Any]], srv_name: str, *, concurrent: bool = False, raw: bool = False
) -> Callable[[F], F]:
    """Make the method the callback of a service.

    Args:
        srv_type: A service class.
        srv_name: Relative to the namespace, absolute with `/`, private with `~/`.
        concurrent: Handle requests concurrently with each other and with the node's other callbacks.
        raw: Give each request as bytes (msgpack), and take the response as bytes.

    Returns:
        The decorator; the method stays as it is.
    """
    return _mark(
        lambda node, callback: node.create_service(
            srv_type, srv_name, callback, concurrent=concurrent, raw=raw
        )
    )


def timer(period_sec: float) -> Callable[[F], F]:
    """Call the method periodically.

    Args:
        period_sec: The period in seconds.

    Returns:
        The decorator; the method stays as it is.
    """
    return _mark(lambda node, callback: node.create_timer(period_sec, callback))


def declared(cls: type, root: type) -> Iterator[tuple[str, Declaration]]:
    """Return (method name, declaration) for everything declared on a class, in the order of definition.

    A method that a subclass overrides counts only as the subclass has it.

    Args:
        cls: The class.
        root: A base class of it that declares nothing, nor do its own bases.
    """
    bases = [base for base in reversed(cls.__mro__) if base not in root.__mro__]
    # Base classes first. A dict as an ordered set, so that an overridden method keeps its first place.
    names = dict.fromkeys(name for base in bases for name in vars(base))
    for name in names:
        # Looked up on the class that is made, so that an override without a decorator declares nothing.
        for declare in getattr(getattr(cls, name, None), _MARKS, ()):
            yield name, declare
