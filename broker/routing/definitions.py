"""The definitions of types that publishers and servers declare, for clients that ask by hash (DESCRIBE).

A definition is believed only if it has the hash that the declaration names, so that nobody can give a type a
false definition. It is kept while an endpoint that declared it exists, so that nobody can push it out.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from proto.errors import ErrorCode
from proto.wire.qos import Refusal
from proto.wire.type_hash import hash_of

if TYPE_CHECKING:
    from broker.routing.records import Peer


MAX_TOTAL_BYTES: Final = 64 * 1024 * 1024
"""Size of all definitions of a graph. A further one is not kept; its endpoint is declared without it."""


class Definitions:
    """The definitions of one graph, by hash.

    Args:
        max_number: Different definitions of one peer.
        max_bytes: Their size.

    Attributes:
        size_bytes: The size of all.
        refused: Definitions that were not kept, because of a limit or because their hash is another one.
    """

    def __init__(self, *, max_number: int, max_bytes: int) -> None:
        self._max_number = max_number
        self._max_bytes = max_bytes
        self._known: dict[str, bytes] = {}
        self._peers: dict[str, int] = {}
        """By hash, how many peers have declared it."""
        self.size_bytes = 0
        self.refused = 0

    def __len__(self) -> int:
        return len(self._known)

    def get(self, type_hash: str) -> bytes | None:
        """Return the definition, if it is known."""
        return self._known.get(type_hash)

    def add(self, peer: Peer, type_hash: str, definition: bytes) -> bool:
        """Keep a definition while an endpoint of the peer uses it.

        Args:
            peer: Declares the endpoint.
            type_hash: The hash in the declaration.
            definition: The definition beside it.

        Returns:
            Whether it is kept; if so, call `release` when the endpoint is removed.

        Raises:
            Refusal: The definition has another hash, or the peer has declared too many.
        """
        known = self._known.get(type_hash)
        # Hashing is skipped for what is known byte for byte: thousands of nodes declare the same few types.
        if definition != known and hash_of(definition) != type_hash:
            self.refused += 1
            raise Refusal(ErrorCode.MALFORMED, "the type's definition does not have the type's hash")
        if type_hash not in peer.definitions:
            self._require_space(peer, len(definition))
            # Not an error of this peer: its endpoint works, only `interface show` cannot show the type.
            if known is None and self.size_bytes + len(definition) > MAX_TOTAL_BYTES:
                self.refused += 1
                return False
            peer.definition_bytes += len(definition)
            self._peers[type_hash] = self._peers.get(type_hash, 0) + 1
            if known is None:
                self._known[type_hash] = definition
                self.size_bytes += len(definition)
        peer.definitions[type_hash] = peer.definitions.get(type_hash, 0) + 1
        return True

    def _require_space(self, peer: Peer, size: int) -> None:
        text = ""
        if len(peer.definitions) >= self._max_number:
            text = f"{self._max_number} types (the broker's --max-definitions)"
        elif peer.definition_bytes + size > self._max_bytes:
            text = f"{self._max_bytes} bytes (the broker's --max-definition-bytes)"
        if text:
            self.refused += 1
            raise Refusal(ErrorCode.LIMIT, f"one connection may declare definitions of {text}")

    def release(self, peer: Peer, type_hash: str) -> None:
        """Drop a definition if no endpoint uses it any more."""
        peer.definitions[type_hash] -= 1
        if peer.definitions[type_hash]:
            return
        del peer.definitions[type_hash]
        definition = self._known[type_hash]
        peer.definition_bytes -= len(definition)
        self._peers[type_hash] -= 1
        if not self._peers[type_hash]:
            del self._peers[type_hash], self._known[type_hash]
            self.size_bytes -= len(definition)
