"""The channels and services of a graph: each has a number of its own, and its definition."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Any, Final, Generic, NamedTuple, TypeVar, cast

from actors.interfaces.cdr import codec_for
from actors.interfaces.definition_texts import definition_text
from actors.web.foxglove.messages import Channel, Service
from actors.web.worker import TooMuchWorkError
from proto.errors import CallboardError
from proto.wire.codes import EntryKind
from proto.wire.names import is_hidden

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from actors.graph.snapshot import GraphSnapshot
    from actors.interfaces.message import Message
    from actors.tools.graph_types import GraphTypes
    from actors.web.worker import WorkShare
    from proto.wire.frames import GraphEntry

T = TypeVar("T", Channel, Service)

MAX_ENTRIES: Final = 5000
"""Channels, and services, that clients are told; their definitions have some KiB each."""

MAX_REMEMBERED: Final = 4 * MAX_ENTRIES
"""Numbers that are kept for what may return."""


MAX_TEXTS: Final = 1000
"""Definitions that are kept, although no channel may have them any more."""


class Declared(NamedTuple):
    """A name with one of its types.

    Attributes:
        name: Of a topic or service.
        type: The type's name.
        digest: The type's hash.
    """

    name: str
    type: str
    digest: str


class Entries(Generic[T]):
    """Channels, or services.

    Attributes:
        present: Those in the graph, by number. Another object after each change.
        classes: The class of each that has been present.
        problems: Why others are left out, by name.
    """

    def __init__(self) -> None:
        self.present: Mapping[int, T] = {}
        self.classes: dict[int, Any] = {}
        self.problems: Mapping[str, str] = {}
        self._known: dict[Declared, T] = {}
        """Also of those that have gone: a number never gets another meaning."""
        self._numbers = 0

    def find(self, declared: Declared) -> T | None:
        """Return the entry that has been made for a declaration."""
        return self._known.get(declared)

    def next_number(self) -> int:
        """Return a number that has not been used."""
        self._numbers += 1
        return self._numbers

    def add(self, declared: Declared, entry: T, cls: Any) -> None:
        """Remember an entry."""
        self._known[declared] = entry
        self.classes[entry.id] = cls

    def replace(self, present: Iterable[T], problems: Mapping[str, str]) -> bool:
        """Replace what is present; return whether that is a change."""
        found = {each.id: each for each in present}
        is_changed = found != self.present or problems != self.problems
        if is_changed:
            self.present, self.problems = found, problems
        for declared in [*self._known]:
            if len(self._known) <= MAX_REMEMBERED:
                break
            if (gone := self._known[declared].id) not in found:
                del self._known[declared], self.classes[gone]
        return is_changed


class Catalogue:
    """The channels and services of one user's graph.

    Args:
        types: The classes of the graph.
        work: The user's share of the thread.

    Attributes:
        channels: The topics.
        services: The services.
    """

    def __init__(self, types: GraphTypes, work: WorkShare) -> None:
        self._types, self._work = types, work
        self.channels: Entries[Channel] = Entries()
        self.services: Entries[Service] = Entries()

    async def update(self, snapshot: GraphSnapshot, published: Iterable[Declared]) -> bool:
        """Make them fit a graph.

        Args:
            snapshot: The graph.
            published: What clients publish.

        Returns:
            Whether something has changed.
        """
        topics, services = await self._work.run(_declared_in, snapshot, tuple(published))
        are_changed = await self._update(self.channels, topics, self._channel)
        return await self._update(self.services, services, self._service) or are_changed

    async def _update(self, entries: Entries[T], wanted: list[Declared], make: Any) -> bool:
        problems = dict[str, str]()
        for each in wanted[MAX_ENTRIES:]:
            problems[each.name] = f"'{each.name}' is left out: there are more than {MAX_ENTRIES}"
            break  # one stands for all
        present = list[T]()
        for each in wanted[:MAX_ENTRIES]:
            found = entries.find(each)
            if found is None:
                try:
                    found, cls = await make(each)
                except TooMuchWorkError:  # it says nothing about the name
                    raise
                except (CallboardError, TypeError) as error:
                    problems[each.name] = f"'{each.name}' is left out: {error}"
                    continue
                entries.add(each, found, cls)
            present.append(found)
        return entries.replace(present, problems)

    async def _channel(self, declared: Declared) -> tuple[Channel, type[Message]]:
        cls = await self._types.declared_message(declared.type, declared.digest)
        text = await self._work.run(_text, cls)
        return Channel(self.channels.next_number(), declared.name, declared.type, text), cls

    async def _service(self, declared: Declared) -> tuple[Service, Any]:
        cls = cast("Any", await self._types.declared_service(declared.type, declared.digest))
        request = await self._work.run(_text, cls.Request)
        response = await self._work.run(_text, cls.Response)
        number = self.services.next_number()
        return Service(number, declared.name, declared.type, request, response), cls


@lru_cache(maxsize=MAX_TEXTS)
def _text(cls: type[Message]) -> str:
    """Return the definition of a class whose messages can be CDR.

    Raises:
        TypeError: They cannot.
    """
    codec_for(cls)
    return definition_text(cls)


def _declared_in(
    snapshot: GraphSnapshot, published: Iterable[Declared]
) -> tuple[list[Declared], list[Declared]]:
    """Return the topics and services of a graph with their types, those of publishers and servers first."""
    topics = _of(snapshot.of_kind(EntryKind.PUBLISHER)) | dict.fromkeys(published)
    with_publishers = {each.name for each in topics}
    heard = _of(snapshot.of_kind(EntryKind.SUBSCRIPTION))
    topics |= {each: None for each in heard if each.name not in with_publishers}
    return sorted(topics), sorted(_of(snapshot.of_kind(EntryKind.SERVICE)))


def _of(entries: Iterable[GraphEntry]) -> dict[Declared, None]:
    return {
        Declared(each.name, each.type_name, each.type_hash): None
        for each in entries
        if each.type_name and not is_hidden(each.name)
    }
