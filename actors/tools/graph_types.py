"""The class of what a topic, service or action carries, as its users have declared it.

    types = GraphTypes(node)
    srv_type = await types.service(await node.get_graph(), "/add_two_ints")

An installed class is used if it has the declared definition; else one is made from the definition that the
broker keeps.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, cast

from actors.actions.names import ActionNames
from actors.interfaces.action import action_types
from actors.interfaces.errors import InvalidMessageError, UnknownInterfaceError
from actors.interfaces.message import Action, Message, Service, type_hash
from actors.interfaces.registry import find_interface, installed_interface
from actors.interfaces.runtime_types import runtime_action, runtime_message, runtime_service
from proto.wire.codes import EntryKind

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable

    from actors.graph.snapshot import GraphSnapshot
    from actors.node.node import Node

MAX_MADE: Final = 1000
"""Classes made from definitions; a class is never freed, so a graph that invents types must end somewhere."""

TOPIC_KINDS: Final = (EntryKind.PUBLISHER, EntryKind.SUBSCRIPTION)
SERVICE_KINDS: Final = (EntryKind.SERVICE, EntryKind.CLIENT)


class GraphTypes:
    """Finds and makes the classes of one graph.

    Args:
        node: Asks the broker for definitions.
        run: Calls a function that takes long, with its arguments; None for at once, on the event loop.
    """

    def __init__(self, node: Node, run: Callable[..., Awaitable[Any]] | None = None) -> None:
        self._node, self._run = node, run
        self._made: dict[tuple[str, ...], type[Any] | InvalidMessageError] = {}
        """By the hashes of their definitions; an error where none can be made, so that it is tried once."""

    async def message(self, snapshot: GraphSnapshot, topic: str, wanted: str = "") -> type[Message]:
        """Return the message class of a topic.

        Args:
            snapshot: The graph.
            topic: The topic's full name.
            wanted: The type's full name, needed if the graph has none or several.

        Raises:
            UnknownInterfaceError: The graph does not say which type it is, or nobody has its definition.
            InvalidMessageError: The definition is of no type that can be made.
            BrokerUnreachable: There is no broker now.
        """
        found = _declared(snapshot, TOPIC_KINDS, topic, wanted)
        if not found and wanted:
            return _of_kind(Message, find_interface(wanted))
        name, digest = _only(found, topic)
        return await self._class(Message, name, digest)

    async def declared_message(self, name: str, digest: str) -> type[Message]:
        """Return the message class that an endpoint has declared.

        Args:
            name: The type's full name.
            digest: Its hash.

        Raises:
            UnknownInterfaceError, InvalidMessageError, BrokerUnreachable: As for `message`.
        """
        return await self._class(Message, name, digest)

    async def declared_service(self, name: str, digest: str) -> type[Service]:
        """Return the service class that an endpoint has declared.

        Args:
            name: The type's full name.
            digest: Its hash.

        Raises:
            UnknownInterfaceError, InvalidMessageError, BrokerUnreachable: As for `message`.
        """
        return await self._class(Service, name, digest)

    async def service(self, snapshot: GraphSnapshot, name: str, wanted: str = "") -> type[Service]:
        """Return the class of a service.

        Args:
            snapshot: The graph.
            name: The service's full name.
            wanted: As for `message`.

        Raises:
            UnknownInterfaceError, InvalidMessageError, BrokerUnreachable: As for `message`.
        """
        declared, digest = _only(_of_service(snapshot, name, wanted), name)
        return await self._class(Service, declared, digest)

    async def action(self, snapshot: GraphSnapshot, name: str, wanted: str = "") -> type[Action]:
        """Return the class of an action.

        Args:
            snapshot: The graph.
            name: The action's full name.
            wanted: As for `message`.

        Raises:
            UnknownInterfaceError, InvalidMessageError, BrokerUnreachable: As for `message`.
        """
        names = ActionNames.of(name)
        goals = _of_service(snapshot, names.send_goal, wanted and f"{wanted}_SendGoal")
        declared, digest = _only(goals, name)
        declared = declared.removesuffix("_SendGoal")
        installed: Any = _installed(Action, declared)
        if installed is not None and type_hash(action_types(installed).send_goal) == digest:
            return cast("type[Action]", installed)
        results = _of_service(snapshot, names.get_result, f"{declared}_GetResult")
        feedback = _declared(snapshot, TOPIC_KINDS, names.feedback, f"{declared}_FeedbackMessage")
        hashes = (digest, _only(results, name)[1], _only(feedback, name)[1])
        return await self._make(runtime_action, hashes)

    async def _class(self, base: type[Any], name: str, digest: str) -> type[Any]:
        installed = _installed(base, name)
        if installed is not None and type_hash(installed) == digest:
            return installed
        return await self._make(runtime_message if base is Message else runtime_service, (digest,))

    async def _make(self, make: Callable[..., type[Any]], hashes: tuple[str, ...]) -> type[Any]:
        if hashes not in self._made:
            definitions = [await self._node.get_type_definition(each) for each in hashes]
            if None in definitions:
                raise UnknownInterfaceError("The type is not installed here, and its definition is not known")
            if len(self._made) >= MAX_MADE:
                raise UnknownInterfaceError(
                    f"{MAX_MADE} types that are not installed here have been used already"
                )
            try:
                self._made[hashes] = await self._run(make, *definitions) if self._run else make(*definitions)
            except InvalidMessageError as error:
                self._made[hashes] = error
        made = self._made[hashes]
        if isinstance(made, InvalidMessageError):
            raise InvalidMessageError(str(made))
        return made


def _declared(
    snapshot: GraphSnapshot, kinds: tuple[EntryKind, ...], name: str, wanted: str
) -> set[tuple[str, str]]:
    """Return the types that are declared for a name, and their hashes."""
    return {
        (entry.type_name, entry.type_hash)
        for entry in snapshot.of_kind(*kinds)
        if entry.name == name and entry.type_name and wanted in {"", entry.type_name}
    }


def _of_service(snapshot: GraphSnapshot, name: str, wanted: str) -> set[tuple[str, str]]:
    """Return what the servers have declared; without one, what the clients have."""
    servers, clients = (_declared(snapshot, (kind,), name, wanted) for kind in SERVICE_KINDS)
    return servers or clients


def _only(found: set[tuple[str, str]], name: str) -> tuple[str, str]:
    if not found:
        raise UnknownInterfaceError(f"The graph does not say of which type {name!r} is")
    if len(found) > 1:
        types = ", ".join(sorted({each for each, _ in found}))
        raise UnknownInterfaceError(f"{name!r} has several types or definitions ({types}); say which")
    return next(iter(found))


def _installed(base: type[Any], name: str) -> type[Any] | None:
    found = installed_interface(name)
    return found if found is not None and issubclass(found, base) else None


def _of_kind(base: type[Any], found: type[Any]) -> type[Any]:
    if not issubclass(found, base):
        raise UnknownInterfaceError(f"{found.__name__} is no {base.__name__.lower()}")
    return found
