"""The graph: all nodes and endpoints that are not suspended, and the links that watch it."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final

from broker.access.rules import Action
from broker.deliveries import Send
from proto import frames, limits
from proto.errors import ErrorCode, ProtocolError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from broker.access.rules import Rights
    from broker.deliveries import Delivery
    from broker.records import Endpoint, Peer
    from proto.frames import GraphEntry

ENTRIES_PER_FRAME: Final = 100
"""Keeps a GRAPH frame below limits.MAX_FRAME_BYTES, however long the names are."""

REMOVED_PER_FRAME: Final = 4000

MAX_WATCHES: Final = 100
"""Kept watches of one link."""

_TYPE_TEXT: Final = re.compile(rf"[A-Za-z0-9_/.-]{{0,{limits.MAX_TYPE_NAME}}}")


class Graph:
    """The entries of one graph, by key."""

    def __init__(self, emit: Callable[[Delivery], None]) -> None:
        self._emit = emit
        self._entries: dict[int, GraphEntry] = {}
        self._watches: dict[tuple[int, int], Rights | None] = {}
        """By link and id, what the link's user may see; None for everything."""
        self._added: dict[int, GraphEntry] = {}
        self._removed: dict[int, GraphEntry] = {}
        self._types: dict[str, dict[int, GraphEntry]] = {}
        """The entries of each type hash, by key."""
        self._visible_types: dict[tuple[Rights, str], bool] = {}
        """Answers of `is_type_visible`, until an entry changes."""
        self._suspended: dict[int, GraphEntry] = {}
        """Entries that watchers know as suspended."""

    def __len__(self) -> int:
        return len(self._entries)

    @property
    def watched(self) -> bool:
        """Whether any link watches for changes."""
        return bool(self._watches)

    def add(self, endpoint: Endpoint) -> None:
        """Add an endpoint that is new or back."""
        entry = endpoint.entry()
        self._entries[endpoint.key] = entry
        self._suspended.pop(endpoint.key, None)
        if entry.type_hash:
            self._types.setdefault(entry.type_hash, {})[entry.key] = entry
            self._visible_types.clear()
        if self._watches:
            self._added[endpoint.key] = entry
            self._removed.pop(endpoint.key, None)

    def remove(self, endpoint: Endpoint, *, suspended: bool = False) -> None:
        """Remove an endpoint that is gone, or suspended and may come back."""
        key = endpoint.key
        entry = self._entries.pop(key, None)
        if entry is not None and entry.type_hash:
            self._forget_type(entry)
        known = self._suspended.pop(key, entry) or entry
        if suspended:
            self._suspended[key] = endpoint.entry()
        if known is not None and self._watches:
            self._added.pop(key, None)
            self._removed[key] = known

    def _forget_type(self, entry: GraphEntry) -> None:
        entries = self._types[entry.type_hash]
        del entries[entry.key]
        if not entries:
            del self._types[entry.type_hash]
        self._visible_types.clear()

    def is_type_visible(self, rights: Rights | None, type_hash: str) -> bool:
        """Return whether somebody with these rights may see an endpoint of a type."""
        if rights is None:
            return True
        key = rights, type_hash
        visible = self._visible_types.get(key)
        if visible is None:
            entries = self._types.get(type_hash, {}).values()
            visible = any(is_visible(rights, entry) for entry in entries)
            if entries:  # a peer may ask for any text
                self._visible_types[key] = visible
        return visible

    def watch(self, peer: Peer, frame: frames.Watch) -> None:
        """Answer WATCH with all entries; keep the watch if the frame says so.

        Raises:
            ProtocolError: The id is in use, or the link has too many watches.
        """
        self.flush()
        key = (peer.id, frame.id)
        if key in self._watches:
            raise ProtocolError(ErrorCode.UNEXPECTED, f"WATCH: the id {frame.id} is in use")
        if frame.keep:
            if sum(owner == peer.id for owner, _ in self._watches) >= MAX_WATCHES:
                raise ProtocolError(ErrorCode.LIMIT, f"more than {MAX_WATCHES} watches on one link")
            self._watches[key] = peer.rights
        self._send(key, *self._seen(peer.rights, self._entries.values(), ()))

    def unwatch(self, peer: Peer, watch: int) -> None:
        """End a kept watch; an unknown one is ignored."""
        self._watches.pop((peer.id, watch), None)

    def forget(self, peer: Peer) -> None:
        """End all watches of a link."""
        for key in [key for key in self._watches if key[0] == peer.id]:
            del self._watches[key]

    def flush(self) -> None:
        """Send the watchers the changes since the last call."""
        if not self._added and not self._removed:
            return
        added, removed = self._added.values(), self._removed.values()
        self._added = {}
        self._removed = {}
        seen: dict[Rights | None, tuple[list[GraphEntry], list[int]]] = {}
        for key, rights in self._watches.items():
            if rights not in seen:
                seen[rights] = self._seen(rights, added, removed)
            if any(seen[rights]):
                self._send(key, *seen[rights])

    def reassess(self, peer: Peer, before: Rights | None) -> None:
        """Send a link's watches what its user sees now and has not seen before, and the reverse."""
        self.flush()
        entries = list(self._entries.values())
        gained = [entry for entry in entries if not is_visible(before, entry)]
        known = [*entries, *self._suspended.values()]
        lost = [entry for entry in known if not is_visible(peer.rights, entry)]
        for key in [key for key in self._watches if key[0] == peer.id]:
            self._watches[key] = peer.rights
            added, _ = self._seen(peer.rights, gained, ())
            _, removed = self._seen(before, (), lost)
            if added or removed:
                self._send(key, added, removed)

    @staticmethod
    def _seen(
        rights: Rights | None, added: Iterable[GraphEntry], removed: Iterable[GraphEntry]
    ) -> tuple[list[GraphEntry], list[int]]:
        """Return what of these entries somebody may see; of the removed ones the keys."""
        return (
            [entry for entry in added if is_visible(rights, entry)],
            [entry.key for entry in removed if is_visible(rights, entry)],
        )

    def _send(self, key: tuple[int, int], added: list[GraphEntry], keys: list[int]) -> None:
        pieces = [
            (tuple(added[start : start + ENTRIES_PER_FRAME]), ())
            for start in range(0, len(added), ENTRIES_PER_FRAME)
        ] + [
            ((), tuple(keys[start : start + REMOVED_PER_FRAME]))
            for start in range(0, len(keys), REMOVED_PER_FRAME)
        ]
        for number, (new, gone) in enumerate(pieces or [((), ())], 1):
            more = number < len(pieces)
            silent = tuple(number for number in gone if number in self._suspended)
            self._emit(Send(key[0], frames.Graph(key[1], more, new, gone, silent)))


def is_visible(rights: Rights | None, entry: GraphEntry) -> bool:
    """Return whether somebody may see an entry: a node, or an endpoint by its own name and its node's."""
    return rights is None or (
        rights.may(Action.SEE, entry.node) and (not entry.name or rights.may(Action.SEE, entry.name))
    )


def is_type_text(text: str) -> bool:
    """Return whether a type's name or hash is valid; "" means any type."""
    return _TYPE_TEXT.fullmatch(text) is not None
