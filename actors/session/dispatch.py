"""Dispatch of the broker's frames: one table from frame types to methods.

A frame for an unknown id is ignored: it crossed the endpoint's UNDECLARE.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, Protocol

from actors.session.endpoint import LinkEndpoint
from proto.errors import ErrorCode
from proto.untrusted_text import peer_text
from proto.wire import frames

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from actors.session.link import Link


class Session(Protocol):
    """What frames about the session itself do; the connection that received them has it."""

    def welcomed(self, frame: frames.Welcome) -> None:
        """Begin the session."""
        ...

    def turned_away(self, frame: frames.Error) -> None:
        """Note the broker's reason, and close."""
        ...

    def name_taken(self, text: str) -> None:
        """Close because another node has this node's name."""
        ...

    def close(self) -> None:
        """End the session; what has been written is still sent."""
        ...


_UNKNOWN: Final = LinkEndpoint()


def _endpoint(link: Link, number: int) -> LinkEndpoint:
    return link.endpoints.get(number, _UNKNOWN)


def _refused(session: Session, link: Link, frame: frames.Refused) -> None:
    if frame.code == ErrorCode.NAME_TAKEN and _endpoint(link, frame.id).owns_link:
        session.name_taken(peer_text(frame.text))
    elif frame.id in link.endpoints:
        link.endpoints[frame.id].refused(frame.code, peer_text(frame.text))
    else:
        link.answer_received(frame.id, frame._replace(text=peer_text(frame.text)))


def _notice(_: Session, link: Link, frame: frames.Notice) -> None:
    _endpoint(link, frame.id).notice(frame._replace(text=peer_text(frame.text)))


def _matched(_: Session, link: Link, frame: frames.Matched) -> None:
    if frame.peers and frame.id in link.endpoints:
        link.matched.add(frame.id)
    else:
        link.matched.discard(frame.id)
    _endpoint(link, frame.id).matched(frame.peers, frame.total)


def _referred(_: Session, link: Link, frame: frames.Reference) -> None:
    batch = link.shared_memory.receive(frame)
    if batch is not None:
        link.attachments.batch_received(batch)


DISPATCH: Final[Mapping[type[Any], Callable[[Session, Link, Any], None]]] = {
    # The session
    frames.Welcome: lambda session, _, frame: session.welcomed(frame),
    frames.Goodbye: lambda session, _, __: session.close(),
    frames.Error: lambda session, _, frame: session.turned_away(frame),
    frames.Pong: lambda _, link, frame: link.pong_received(frame.token),
    # An endpoint, by its id
    frames.Accepted: lambda _, link, frame: link.endpoints.get(frame.id, _UNKNOWN).accepted(frame.number),
    frames.Refused: _refused,
    frames.Matched: _matched,
    frames.Notice: _notice,
    frames.Request: lambda _, link, frame: _endpoint(link, frame.endpoint).requested(frame.entries),
    frames.Cancel: lambda _, link, frame: _endpoint(link, frame.endpoint).cancelled(frame.calls),
    frames.Reply: lambda _, link, frame: _endpoint(link, frame.endpoint).replied(frame.entries),
    # A publisher of this node, by the id that the broker gave it
    frames.Credit: lambda _, link, frame: link.publishers.get(frame.publisher, _UNKNOWN).credit_received(
        frame
    ),
    # Publishers of other nodes, attached to subscriptions of this one
    frames.Batch: lambda _, link, frame: link.attachments.batch_received(frame),
    frames.Replay: lambda _, link, frame: link.attachments.replay_received(frame),
    frames.Attached: lambda _, link, frame: link.attachments.attached(frame),
    frames.Detached: lambda _, link, frame: link.attachments.detached(frame),
    frames.Assert: lambda _, link, frame: link.attachments.asserted(frame),
    # Messages in shared memory
    frames.Reference: _referred,
    frames.Release: lambda _, link, frame: link.shared_memory.released(frame),
    frames.Arena: lambda _, link, frame: link.shared_memory.arena_announced(frame),
    frames.Mapped: lambda _, link, frame: link.shared_memory.mapped(frame),
    frames.Unmap: lambda _, link, frame: link.shared_memory.unmapped(frame),
    # An answer, by the query's key
    frames.Graph: lambda _, link, frame: link.answer_received(frame.watch, frame),
    frames.Definition: lambda _, link, frame: link.answer_received(frame.type_hash, frame),
    frames.Stats: lambda _, link, frame: link.answer_received(frame.id, frame),
}
"""By frame type, a function of the session, the node's link, and the frame."""
