"""The base of everything with an id on a link: the node, publishers, subscriptions, services, clients."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from proto.wire import frames


class LinkEndpoint:
    """What the link calls on an endpoint. Each kind overrides the methods for the frames that it gets.

    Attributes:
        id: Its number on the link.
        owns_link: Whether the link ends if the broker refuses its name: for the node that the link is for.
    """

    id = 0
    owns_link = False

    def declaration(self) -> frames.Frame:
        """Return the frame that declares it."""
        raise NotImplementedError

    def accepted(self, number: int) -> None:
        """Note that the broker has accepted the declaration; `number` is a publisher's id."""

    def refused(self, code: int, text: str) -> None:
        """Note that the broker has refused the declaration."""

    def matched(self, peers: int, total: int) -> None:
        """Note how many counterparts there are now, and how many there have been in this session."""

    def notice(self, notice: frames.Notice) -> None:
        """Take a warning of the broker."""

    def credit_received(self, frame: frames.Credit) -> None:
        """Take a publisher's credit."""

    def requested(self, entries: tuple[frames.RequestEntry, ...]) -> None:
        """Take requests for a service."""

    def cancelled(self, calls: tuple[int, ...]) -> None:
        """Cancel calls whose callers have given up."""

    def replied(self, entries: tuple[frames.ReplyEntry, ...]) -> None:
        """Take replies to a client's calls."""

    def session_ended(self) -> None:
        """Forget what belonged to the session; the link declares the endpoint again in the next one."""
