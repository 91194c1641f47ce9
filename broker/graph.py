"""The graph: all nodes and endpoints that are not suspended, and the links that watch it."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final

from broker.deliveries import Send
from proto import frames, limits
from proto.errors import ErrorCode, ProtocolError

if TYPE_CHECKING:
    from collections.abc import Callable

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
        self._watches: dict[tuple[int, int], None] = {}
        self._added: dict[int, GraphEntry] = {}
        self._removed: dict[int, bool] = {}
        """Keys, and whether their endpoints are only suspended."""
        self._suspended: set[int] = set()
        """Keys that watchers know as suspended."""

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
        self._suspended.discard(endpoint.key)
        if self._watches:
            self._added[endpoint.key] = entry
            self._removed.pop(endpoint.key, None)

    def remove(self, endpoint: Endpoint, *, suspended: bool = False) -> None:
        """Remove an endpoint that is gone, or suspended and may come back."""
        key = endpoint.key
        known = self._entries.pop(key, None) is not None or key in self._suspended
        self._suspended.discard(key)
        if suspended:
            self._suspended.add(key)
        if known and self._watches:
            self._added.pop(key, None)
            self._removed[key] = suspended

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
            self._watches[key] = None
        self._send(key, list(self._entries.values()), {})

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
        added, removed = list(self._added.values()), self._removed
        self._added = {}
        self._removed = {}
        for key in self._watches:
            self._send(key, added, removed)

    def _send(self, key: tuple[int, int], added: list[GraphEntry], removed: dict[int, bool]) -> None:
        keys = list(removed)
        pieces = [
            (tuple(added[start : start + ENTRIES_PER_FRAME]), ())
            for start in range(0, len(added), ENTRIES_PER_FRAME)
        ] + [
            ((), tuple(keys[start : start + REMOVED_PER_FRAME]))
            for start in range(0, len(keys), REMOVED_PER_FRAME)
        ]
        for number, (new, gone) in enumerate(pieces or [((), ())], 1):
            more = number < len(pieces)
            silent = tuple(key for key in gone if removed[key])
            self._emit(Send(key[0], frames.Graph(key[1], more, new, gone, silent)))


def is_type_text(text: str) -> bool:
    """Return whether a type's name or hash is valid; "" means any type."""
    return _TYPE_TEXT.fullmatch(text) is not None
