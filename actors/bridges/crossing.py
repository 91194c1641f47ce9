"""The messages of one topic in one direction: from many publishers of one side to their mirrors.

Pure but for what it is given: how messages are converted, and the mirrors that send them. A message goes out
through the mirror of the node that published it. One that arrives before this mirror exists waits for it,
because a node that has just appeared publishes its first messages at once; latched ones that arrive again,
since the receiving subscription was made again, do not cross twice. Only if a mirror is made again, with
another QoS or name, they do: otherwise late joiners of the new one would miss them.
"""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, Final

from actors.interfaces.errors import InvalidMessageError
from proto.errors import CallboardError

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.bridges.counters import Counts

MAX_PUBLISHERS: Final = 10_000
"""Publishers remembered for one topic, dead ones included: more than any topic has at a time."""

HELD_MESSAGES: Final = 10
"""Messages of one publisher that wait for its mirror; the depth of most publishers."""

MAX_HELD_BYTES: Final = 8 * 1024 * 1024
"""What waits for mirrors, on one topic; a single message, such as a latched map, may have any size."""


UNNUMBERED: Final = 2**64 - 1
"""The number of all messages of a middleware that numbers none: rmw's
RMW_MESSAGE_INFO_SEQUENCE_NUMBER_UNSUPPORTED."""


class _Publisher:
    """What is known of one publisher of the side where messages come from."""

    __slots__ = ("held", "is_counted", "last", "node", "replayed_to", "send")

    def __init__(self, node: str, send: Callable[[bytes, int], None] | None) -> None:
        self.node = node
        self.send = send
        self.last = -1
        """The number of its newest message."""
        self.is_counted = False
        """Whether gaps in its numbers are losses: not where the receiving subscription has just begun."""
        self.held: deque[tuple[bytes, int]] | None = None
        self.replayed_to = -1
        """Its newest message that an earlier mirror has sent; -1 if the present one is the first."""


class Crossing:
    """One topic in one direction.

    Args:
        convert: Converts a message; raises InvalidMessageError.
        counts: Counts what crosses, and what does not.
        node_of: Returns the node that a publisher, named by its 16 bytes, belongs to; "" if it is not known
            yet, None for a publisher whose messages must not cross (a mirror).
        max_publishers: Publishers to remember.
        max_held_bytes: What may wait for mirrors.
    """

    def __init__(
        self,
        convert: Callable[[bytes], bytes],
        counts: Counts,
        node_of: Callable[[bytes], str | None],
        *,
        max_publishers: int = MAX_PUBLISHERS,
        max_held_bytes: int = MAX_HELD_BYTES,
    ) -> None:
        self._convert = convert
        self._counts = counts
        self._node_of = node_of
        self._max_publishers, self._max_held_bytes = max_publishers, max_held_bytes
        self._mirrors: dict[str, Callable[[bytes, int], None]] = {}
        self._publishers: dict[bytes, _Publisher] = {}
        self._unknown: set[bytes] = set()
        """Publishers whose node is not known yet."""
        self._held_bytes = 0
        self.wants_replay = False
        """Whether latched messages should arrive once more, for a mirror that was made again."""

    def add_mirror(self, node: str, send: Callable[[bytes, int], None]) -> None:
        """Send the messages of a node's publishers by a mirror from now on, and those that wait for it.

        Args:
            node: The node on the side where messages come from.
            send: Gets each message, converted, and its source's time in ns; raises CallboardError if the
                other side refuses it.
        """
        self._mirrors[node] = send
        for publisher in self._publishers.values():
            if publisher.node == node:
                self.wants_replay |= publisher.replayed_to >= 0
                self._release(publisher, send)
        self.look_again()

    def look_again(self) -> None:
        """Find the nodes of publishers that were not known when they were heard."""
        for gid in tuple(self._unknown):
            publisher = self._publishers[gid]
            node = self._node_of(gid)
            if node == "":
                continue
            self._unknown.discard(gid)
            if node is None:
                self._forget(gid)
                continue
            publisher.node = node
            if node in self._mirrors:
                self._release(publisher, self._mirrors[node])

    def _release(self, publisher: _Publisher, send: Callable[[bytes, int], None]) -> None:
        """Send by a mirror what has waited for it, and what follows."""
        publisher.send = send
        held, publisher.held = publisher.held or (), None
        for data, stamp_ns in held:
            self._held_bytes -= len(data)
            self._pass_on(publisher, data, stamp_ns)

    @property
    def waiting(self) -> set[str]:
        """The nodes whose messages wait for a mirror; without those of publishers that are not known yet."""
        if not self._held_bytes:
            return set()
        return {each.node for each in self._publishers.values() if each.held and each.node}

    def send_held(self, node: str, send: Callable[[bytes, int], None]) -> None:
        """Send what waits for a node's mirror by something else, as there will be none.

        Args:
            node: The node.
            send: As for `add_mirror`.
        """
        for publisher in self._publishers.values():
            if publisher.node == node:
                self._release(publisher, send)
                publisher.send = None

    def drop_refused(self, is_refused: Callable[[str], bool]) -> None:
        """Drop what waits for mirrors that will not come, although the nodes are there.

        Otherwise it would be sent when they may cross, or leave: the time of a second clock, say.

        Args:
            is_refused: Returns whether a node publishes on this topic and does not cross.
        """
        refused = {node for node in self.waiting if is_refused(node)}
        for publisher in self._publishers.values() if refused else ():
            if publisher.node in refused and publisher.held:
                self._held_bytes -= sum(len(data) for data, _ in publisher.held)
                self._counts.drop("its publisher does not cross", count=len(publisher.held))
                publisher.held = None

    def retire_mirror(self, node: str, send: Callable[[bytes, int], None]) -> None:
        """Let a mirror that goes send for the publishers only that it has sent for.

        Another publisher of the node belongs to its next run, and its messages wait for the next mirror: what
        is known of it must not be forgotten with this one.

        Args:
            node: The node.
            send: Its mirror, as for `add_mirror`.
        """
        if self._mirrors.get(node) == send:
            del self._mirrors[node]

    def remove_mirror(self, node: str, send: Callable[[bytes, int], None] | None = None) -> None:
        """Forget a node that has gone, with its publishers and their messages that wait.

        Args:
            node: The node.
            send: Its mirror, as for `add_mirror`, if only the publishers for which it sends have gone: the
                node may be back, and has another one then.
        """
        if send is None or self._mirrors.get(node) == send:
            self._mirrors.pop(node, None)
        for gid, publisher in tuple(self._publishers.items()):
            if publisher.node == node and (send is None or publisher.send == send):
                self._forget(gid)

    def replace_mirror(self, node: str, send: Callable[[bytes, int], None] | None = None) -> None:
        """Forget a node's mirror, which kept latched messages; another one follows, and needs them again.

        The originals are asked for them once more (`replay`): they alone know what is still latched.

        Args:
            node: The node on the side where messages come from.
            send: Its mirror, as for `remove_mirror`.
        """
        if send is not None and self._mirrors.get(node) != send:
            return
        self._mirrors.pop(node, None)
        for publisher in self._publishers.values():
            if publisher.node == node:
                publisher.send = None
                if publisher.last != UNNUMBERED:
                    publisher.replayed_to = max(publisher.replayed_to, publisher.last)
                    publisher.last, publisher.is_counted = -1, False

    def replay(self, data: bytes, gid: bytes, number: int, stamp_ns: int) -> None:
        """Pass a latched message on that has crossed already, if its mirror was made again.

        Args:
            data: The message.
            gid: 16 bytes that name its publisher.
            number: Its number among the publisher's messages.
            stamp_ns: When it was published, in ns since the epoch.
        """
        publisher = self._publishers.get(gid)
        # What is newer arrives as well where it always does; then older ones would come too late.
        if (
            publisher is None
            or publisher.send is None
            or not publisher.last < number <= publisher.replayed_to
        ):
            return
        publisher.last = number
        self._pass_on(publisher, data, stamp_ns, is_new=False)

    def begin(self) -> None:
        """Note that messages are received from now on: what was published before is not lost."""
        for publisher in self._publishers.values():
            publisher.is_counted = False

    def receive(self, data: bytes, gid: bytes, number: int, stamp_ns: int, node: str = "") -> None:
        """Pass a message on.

        Args:
            data: The message.
            gid: 16 bytes that name its publisher.
            number: Its number among the publisher's messages, or `UNNUMBERED`.
            stamp_ns: When it was published, in ns since the epoch.
            node: Its publisher's node, if that comes with the message.
        """
        publisher = self._publishers.get(gid)
        if publisher is None:
            found = node or self._node_of(gid)
            if found is None:
                return
            publisher = self._add(gid, found)
        counts, last = self._counts, publisher.last
        if number <= last and number != UNNUMBERED:
            counts.repeated += 1
            return
        if publisher.is_counted and number > last + 1:
            counts.lost += number - last - 1
        publisher.last = number
        publisher.is_counted = True
        counts.received += 1
        if publisher.send is None:
            self._hold(publisher, data, stamp_ns)
        else:
            self._pass_on(publisher, data, stamp_ns)

    def _add(self, gid: bytes, node: str) -> _Publisher:
        if len(self._publishers) >= self._max_publishers:
            self._forget(next(iter(self._publishers)))
        publisher = self._publishers[gid] = _Publisher(node, self._mirrors.get(node))
        if not node:
            self._unknown.add(gid)
        return publisher

    def _forget(self, gid: bytes) -> None:
        publisher = self._publishers.pop(gid)
        self._unknown.discard(gid)
        for data, _ in publisher.held or ():
            self._held_bytes -= len(data)
            self._counts.drop("its publisher left before it had a mirror")

    def _hold(self, publisher: _Publisher, data: bytes, stamp_ns: int) -> None:
        if publisher.held is None:
            publisher.held = deque()
        held = publisher.held
        if len(held) >= HELD_MESSAGES:
            self._held_bytes -= len(held.popleft()[0])
            self._counts.drop("too many waited for their publisher's mirror")
        if self._held_bytes and self._held_bytes + len(data) > self._max_held_bytes:
            self._counts.drop("too much waited for publishers' mirrors")
            return
        self._held_bytes += len(data)
        held.append((data, stamp_ns))

    def _pass_on(self, publisher: _Publisher, data: bytes, stamp_ns: int, *, is_new: bool = True) -> None:
        send = publisher.send
        assert send is not None
        try:
            send(self._convert(data), stamp_ns)
        except InvalidMessageError as error:
            self._counts.drop("invalid", str(error))
        except CallboardError as error:
            self._counts.drop("refused", str(error))
        else:
            self._counts.sent += is_new
