"""The graph: all nodes and endpoints that are not suspended, and the links that watch it."""

from __future__ import annotations

import re
from collections import Counter
from functools import lru_cache
from itertools import islice
from typing import TYPE_CHECKING, Final, NamedTuple

from broker.access.rules import Action
from broker.routing.deliveries import Send, SendEncoded
from proto import limits
from proto.errors import ErrorCode, ProtocolError
from proto.wire import frames
from proto.wire.codec import encode_graph, encode_graph_changes, encode_graph_entry
from proto.wire.qos import Refusal

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from broker.access.rules import Rights
    from broker.routing.deliveries import Delivery
    from broker.routing.records import Endpoint, Peer
    from broker.routing.refusals import Refusals

ENTRIES_PER_FRAME: Final = 100
"""Keeps a GRAPH frame below limits.MAX_FRAME_BYTES, however long the names are."""

REMOVED_PER_FRAME: Final = 4000

MAX_WATCHES: Final = 100
"""Kept watches of one link."""

MAX_UNANSWERED: Final = 100
"""WATCHes of one link that wait for their answers, kept or not."""

MAX_BROKER_WATCHES: Final = 1000
"""Kept watches of all links: each gets every change of its graph."""

ENTRIES_PER_REPORT: Final = 20_000
"""Entries sent in answer to WATCHes in one loop turn, or one answer: it costs much more than its question."""

_TYPE_TEXT: Final = re.compile(rf"[A-Za-z0-9_/.-]{{0,{limits.MAX_TYPE_NAME}}}")


class _Watch(NamedTuple):
    """A watch without an answer yet: what its user may see (None: everything), and whether to keep it."""

    rights: Rights | None
    keep: bool


class WatchCount:
    """The kept watches of all graphs of a broker.

    Attributes:
        most: How many there may be.
        kept: How many there are.
    """

    def __init__(self, most: int = MAX_BROKER_WATCHES) -> None:
        self.most = most
        self.kept = 0


class Graph:
    """The entries of one graph, by key.

    Changes and answers to WATCH are collected until `flush`. Entries are encoded once, when somebody first
    asks, and changes once for all watches whose users may see the same: only the head of a frame depends on
    the watch.

    Args:
        emit: Takes each delivery.
        count: The kept watches of all graphs of the broker.
        refusals: Counts the watches that are refused.
    """

    def __init__(self, emit: Callable[[Delivery], None], count: WatchCount, refusals: Refusals) -> None:
        self._emit = emit
        self._count = count
        self._refusals = refusals
        self._entries: dict[int, Endpoint] = {}
        self._encoded: dict[int, bytes] = {}
        """By key, the entries that have been sent, as they are encoded in GRAPH frames."""
        self._watches: dict[tuple[int, int], Rights | None] = {}
        """Kept watches that have been answered, by peer and id: what the peer's user may see."""
        self._unanswered: dict[tuple[int, int], _Watch] = {}
        self._unanswered_of: Counter[int] = Counter()
        """How many of them each peer has."""
        self._added: dict[int, Endpoint] = {}
        self._removed: dict[int, Endpoint] = {}
        self._types: dict[str, dict[int, Endpoint]] = {}
        """The entries of each type hash, by key."""
        self._visible_types: dict[tuple[Rights, str], bool] = {}
        """Answers of `is_type_visible`, until an entry changes."""
        self._suspended: dict[int, Endpoint] = {}
        """Entries that watchers know as suspended."""

    def __len__(self) -> int:
        return len(self._entries)

    @property
    def watched(self) -> bool:
        """Whether any link watches for changes."""
        return bool(self._watches or self._unanswered)

    @property
    def asked(self) -> bool:
        """Whether a WATCH waits for its answer."""
        return bool(self._unanswered)

    def add(self, endpoint: Endpoint) -> None:
        """Add an endpoint that is new or back."""
        key = endpoint.key
        self._entries[key] = endpoint
        self._suspended.pop(key, None)
        if endpoint.type_hash:
            of_type = self._types.get(endpoint.type_hash)
            if of_type is None:
                of_type = self._types[endpoint.type_hash] = {}
            of_type[key] = endpoint
            self._visible_types.clear()
        if self._watches:
            # Only the last state before a flush counts: what came and went in between is not told.
            self._added[key] = endpoint
            self._removed.pop(key, None)

    def remove(self, endpoint: Endpoint, *, suspended: bool = False) -> None:
        """Remove an endpoint that is gone, or suspended and may come back."""
        key = endpoint.key
        shown = self._entries.pop(key, None)
        self._encoded.pop(key, None)
        if shown is not None and shown.type_hash:
            self._forget_type(shown)
        # Watchers were told of a suspended entry, so they must be told of its end, although it is not in the
        # graph.
        known = self._suspended.pop(key, None) or shown
        if suspended:
            self._suspended[key] = endpoint
        if known is not None and self._watches:
            self._added.pop(key, None)
            self._removed[key] = known

    def _forget_type(self, endpoint: Endpoint) -> None:
        entries = self._types[endpoint.type_hash]
        del entries[endpoint.key]
        if not entries:
            del self._types[endpoint.type_hash]
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

    def endpoints(self) -> tuple[Endpoint, ...]:
        """Return all endpoints that are not suspended."""
        return tuple(self._entries.values())

    def other_brokers_of_type(self, type_hash: str) -> list[int]:
        """Return the numbers of the other brokers of the mesh that have endpoints of a type, in order."""
        return sorted({each.broker for each in self._types.get(type_hash, {}).values() if each.mirrored})

    def watch(self, peer: Peer, frame: frames.Watch) -> None:
        """Answer WATCH with all entries, with the next `flush`; keep the watch if the frame says so.

        A watch to be kept is refused if the broker has too many.

        Raises:
            ProtocolError: The id is in use, or the link has too many watches, kept or without an answer.
        """
        key = (peer.id, frame.id)
        if key in self._watches or key in self._unanswered:
            raise ProtocolError(ErrorCode.UNEXPECTED, f"WATCH: the id {frame.id} is in use")
        if self._unanswered_of[peer.id] >= MAX_UNANSWERED:
            text = f"more than {MAX_UNANSWERED} WATCHes of one link wait for answers: send fewer at a time"
            raise self._refusals.error(text)
        if frame.keep:
            if peer.watches >= MAX_WATCHES:
                text = f"more than {MAX_WATCHES} watches on one link: end some with UNWATCH"
                raise self._refusals.error(text)
            if self._count.kept >= self._count.most:
                text = f"the broker keeps {self._count.most} watches of the graph (--max-watches)"
                self._refusals.add(peer, text)
                self._emit(Send(peer.id, frames.Refused(frame.id, ErrorCode.LIMIT, text)))
                return
            peer.watches += 1
            self._count.kept += 1
        self._unanswered[key] = _Watch(peer.rights, frame.keep)
        self._unanswered_of[peer.id] += 1

    def unwatch(self, peer: Peer, watch: int) -> None:
        """End a kept watch; an unknown one is ignored."""
        key = (peer.id, watch)
        unanswered = self._unanswered.get(key)
        if key in self._watches:
            del self._watches[key]
            self._end_watches(peer, 1)
        elif unanswered and unanswered.keep:  # it is answered all the same, so that its client need not wait
            self._unanswered[key] = unanswered._replace(keep=False)
            self._end_watches(peer, 1)

    def _end_watches(self, peer: Peer, number: int) -> None:
        peer.watches -= number
        self._count.kept -= number

    def forget(self, peer: Peer) -> None:
        """End all watches of a link."""
        if peer.watches:
            for key in [key for key in self._watches if key[0] == peer.id]:
                del self._watches[key]
            self._end_watches(peer, peer.watches)
        for key in [key for key in self._unanswered if key[0] == peer.id]:
            del self._unanswered[key]
        self._unanswered_of.pop(peer.id, None)

    def flush(self) -> None:
        """Send the watchers the changes since the last call, and then answer new watches, as many as fit."""
        if self._added or self._removed:
            # Replaced, not cleared: the values that are sent below belong to the old ones.
            added, removed = self._added.values(), self._removed.values()
            self._added = {}
            self._removed = {}
            for rights, watches in _by_rights(self._watches.items()).items():
                self._send(watches, self._encode(rights, added, removed))
        if self._unanswered:
            # Changes came first: an answer below has them already, and its watch is kept only afterwards.
            most = max(1, ENTRIES_PER_REPORT // (len(self._entries) or 1))
            now = dict(islice(self._unanswered.items(), most))
            for rights, watches in _by_rights((key, watch.rights) for key, watch in now.items()).items():
                pieces = self._encode(rights, self._entries.values(), ())
                self._send(watches, pieces or [encode_graph_changes((), (), ())])
            for key, watch in now.items():
                del self._unanswered[key]
                self._unanswered_of[key[0]] -= 1
                if watch.keep:
                    self._watches[key] = watch.rights
            if not self._unanswered:
                self._unanswered_of.clear()

    def reassess(self, peer: Peer, before: Rights | None) -> None:
        """Send a link's watches what its user sees now and has not seen before, and the reverse."""
        watches = [key for key in self._watches if key[0] == peer.id]
        for key in [key for key in self._unanswered if key[0] == peer.id]:
            self._unanswered[key] = self._unanswered[key]._replace(rights=peer.rights)
        if not watches:
            return
        # What the watches know must be complete before it is compared with what they may see now.
        self.flush()
        shown = self._entries.values()
        known = [*shown, *self._suspended.values()]
        gained = [entry for entry in shown if not is_visible(before, entry)]
        lost = [entry for entry in known if not is_visible(peer.rights, entry)]
        self._watches.update(dict.fromkeys(watches, peer.rights))
        self._send(watches, self._encode(peer.rights, gained, ()))
        self._send(watches, self._encode(before, (), lost))

    def _encode(
        self, rights: Rights | None, added: Iterable[Endpoint], removed: Iterable[Endpoint]
    ) -> list[bytes]:
        """Return what of these changes somebody may see, in pieces; each is a GRAPH frame of a watch."""
        new = [self._encode_entry(entry) for entry in added if is_visible(rights, entry)]
        gone = [entry.key for entry in removed if is_visible(rights, entry)]
        pieces = [
            encode_graph_changes(new[start : start + ENTRIES_PER_FRAME], (), ())
            for start in range(0, len(new), ENTRIES_PER_FRAME)
        ]
        for start in range(0, len(gone), REMOVED_PER_FRAME):
            part = gone[start : start + REMOVED_PER_FRAME]
            pieces.append(encode_graph_changes((), part, [key for key in part if key in self._suspended]))
        return pieces

    def _encode_entry(self, endpoint: Endpoint) -> bytes:
        encoded = self._encoded.get(endpoint.key)
        if encoded is None:
            encoded = self._encoded[endpoint.key] = encode_graph_entry(endpoint.entry())
        return encoded

    def _send(self, watches: Iterable[tuple[int, int]], pieces: list[bytes]) -> None:
        last = len(pieces) - 1
        for peer, watch in watches:
            for number, changes in enumerate(pieces):
                raw = encode_graph(watch, more=number < last, changes=changes)
                self._emit(SendEncoded(peer, raw))


def _by_rights(
    watches: Iterable[tuple[tuple[int, int], Rights | None]],
) -> dict[Rights | None, list[tuple[int, int]]]:
    """Group watches by what their users may see."""
    groups: dict[Rights | None, list[tuple[int, int]]] = {}
    for key, rights in watches:
        groups.setdefault(rights, []).append(key)
    return groups


def is_visible(rights: Rights | None, endpoint: Endpoint) -> bool:
    """Return whether somebody may see a node, or an endpoint by its own name and its node's."""
    return rights is None or (
        rights.may(Action.SEE, endpoint.node_name)
        and (endpoint.node is None or rights.may(Action.SEE, endpoint.name))
    )


@lru_cache(maxsize=1000)
def check_type(name: str, type_hash: str) -> tuple[str, str]:
    """Check a type's name and hash; "" means any type. Pairs that were valid are kept, which are small.

    Returns:
        The two, the same objects for all endpoints of the type.

    Raises:
        Refusal: They are invalid.
    """
    if not (_TYPE_TEXT.fullmatch(name) and _TYPE_TEXT.fullmatch(type_hash)):
        text = "a type's name and hash are at most 255 letters, digits and /_.-"
        raise Refusal(ErrorCode.MALFORMED, text)
    return name, type_hash
