"""The names of one graph's nodes: unique, unless the nodes that have one share it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from broker.routing.deliveries import Send
from proto.errors import ErrorCode, ProtocolError
from proto.wire import frames
from proto.wire.codes import NoticeKind
from proto.wire.qos import Refusal

if TYPE_CHECKING:
    from collections.abc import Callable

    from broker.routing.deliveries import Delivery
    from broker.routing.records import NodeRecord, Peer


class NodeNames:
    """The nodes that have each name.

    Args:
        emit: Takes each delivery.
        replace_peer: Called with a suspended peer whose name another node takes, and the reason; removes it.
        revoke: Called with a node that yields its name to another one, and the reason; removes it.
    """

    def __init__(
        self,
        emit: Callable[[Delivery], None],
        replace_peer: Callable[[Peer, str], None],
        revoke: Callable[[NodeRecord, str], None],
    ) -> None:
        self._emit = emit
        self._replace_peer = replace_peer
        self._revoke = revoke
        self._holders: dict[str, dict[int, NodeRecord]] = {}
        """By name and key: one, several that share it, or those of several brokers."""

    def holders(self, name: str) -> dict[int, NodeRecord]:
        """Return the nodes that have a name, by key."""
        return self._holders.get(name, {})

    def claim(self, peer: Peer, name: str, *, shared: bool) -> None:
        """Check that a peer's node may have a name; remove holders that yield, or have been silent for long.

        Raises:
            Refusal: Another node has the name.
            ProtocolError: The name is kept for a silent node.
        """
        holders = self.holders(name)
        if not holders or (shared and _any(holders).shared):  # several have shared it with each other
            return
        if not shared and all(each.yields for each in holders.values()):
            text = f"a node named '{name}' has come, and does not share its name"
            # Those of other brokers learn of it from the graph.
            for each in [each for each in holders.values() if not each.mirrored]:
                self._revoke(each, text)
            return
        self._displace(peer, holders, shared=shared)

    def _displace(self, peer: Peer, holders: dict[int, NodeRecord], *, shared: bool) -> None:
        peers = (holder.peer for holder in holders.values())
        # Only silent holders can lose a name, and only after a grace time: a node must not lose its name to a
        # second copy of itself because its process was busy or frozen for a moment.
        keeper = next((each for each in peers if not each.suspended), None)
        if keeper is None:
            silent = {holder.peer.id: holder.peer for holder in holders.values()}.values()
            keeper = next((each for each in silent if not each.names_released), None)
            if keeper is None:
                text = f"another node '{_any(holders).name}' has come while this link was silent"
                for each in silent:
                    self._replace_peer(each, text)
                return
        # Check the holder closely from now on: if it is dead, the newcomer need not wait for the idle
        # keepalive.
        keeper.relied_on.add(keeper.id)
        name = f"A node named '{_any(holders).name}'"
        if keeper.suspended and not peer.endpoints:
            text = f"{name} is silent; this one gets its name if it does not come back"
            raise ProtocolError(ErrorCode.NAME_TAKEN, text)  # every client connects again after an ERROR
        text = f"{name} is there already"
        if shared:
            text += " and does not share its name"
        text += "; give this one another name"
        if _any(holders).shared:
            text += ", or share the name as that one does"
        raise Refusal(ErrorCode.NAME_TAKEN, text)

    def add(self, node: NodeRecord) -> None:
        """Note that a node has its name."""
        self._holders.setdefault(node.name, {})[node.key] = node

    def remove(self, node: NodeRecord) -> None:
        """Note that a node has gone."""
        holders = self._holders[node.name]
        del holders[node.key]
        if not holders:
            del self._holders[node.name]

    def report_duplicates(self, newcomer: NodeRecord) -> None:
        """Tell this broker's nodes with the name of a node that joins that another broker has one, too."""
        holders = self._holders[newcomer.name].values()
        others = [
            each
            for each in holders
            if each is not newcomer
            and not (each.shared and newcomer.shared)
            and not (each.yields or newcomer.yields)  # one of them goes
        ]
        if not others:
            return
        text = f"Another broker of the mesh has a node named '{newcomer.name}', too: rename one of them"
        for node in (newcomer, *others):
            if not (node.mirrored or node.peer.suspended):
                notice = frames.Notice(node.id, NoticeKind.DUPLICATE_NAME, text, 0, 1)
                self._emit(Send(node.peer.id, notice))


def _any(holders: dict[int, NodeRecord]) -> NodeRecord:
    """Return one of a name's holders, which all share the name if there are several of one broker.

    It is the latest one: earlier ones of other brokers may yield the name to it.
    """
    return next(reversed(holders.values()))
