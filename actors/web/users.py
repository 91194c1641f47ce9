"""Workspaces for the users of a broker with access rules, so that each sees and does what the rules allow."""

from __future__ import annotations

import asyncio
import hashlib
from contextlib import asynccontextmanager
from typing import TYPE_CHECKING, Final

from actors.errors import BrokerUnreachable, NotAuthorized
from actors.web.observer import Observer
from actors.web.workspace import Workspace
from proto.errors import CallboardError
from proto.limits import MAX_TOKEN_CHARACTERS

if TYPE_CHECKING:
    from collections.abc import AsyncGenerator

MAX_USERS: Final = 16
"""Tokens with a workspace at the same time; then the one that has been unused for longest makes room."""

MAX_OPENING: Final = 4
"""Tokens that the broker is asked about at the same time."""

IDLE_SEC: Final = 60.0
"""How long a workspace that nobody uses stays open."""

UNKNOWN: Final = "The broker knows no user with this token"


class TooManyUsersError(CallboardError):
    """As many users as the server takes are signed in, or sign in. Try again later."""


class NoUsersError(CallboardError):
    """The broker has no users. Start it with `--auth`, or the web server without `--users`."""


def require_users(observer: Observer) -> None:
    """Raise unless the observer's broker has users, so that it refuses tokens that are no user's.

    Args:
        observer: Connected.

    Raises:
        NoUsersError: It has none.
    """
    if observer.node.user is None:
        raise NoUsersError(
            "The broker has no users: start it with --auth FILE, or the web server without --users"
        )


class _Entry:
    """A workspace, and how many use it.

    Args:
        opening: Returns it.
    """

    def __init__(self, opening: asyncio.Task[Workspace]) -> None:
        self.opening = opening
        self.uses = 0
        self.expiry: asyncio.TimerHandle | None = None

    @property
    def lost(self) -> bool:
        """Whether it has no session with the broker any more."""
        return self.opening.done() and not self.opening.result().observer.connected


class Users:
    """Workspaces by tokens: opened by the first request, shared by all of a token, closed when unused.

    Args:
        url: The broker's URLs.
        domain: The domain id.
    """

    def __init__(self, url: str, domain: int) -> None:
        self._url, self._domain = url, domain
        self._entries: dict[bytes, _Entry] = {}
        """By the hash of the token, the one used last at the end; without those that failed."""
        self._closing: set[asyncio.Task[None]] = set()

    @asynccontextmanager
    async def workspace(self, token: str) -> AsyncGenerator[Workspace]:
        """Use the workspace of a token's user.

        Args:
            token: As presented.

        Raises:
            NotAuthorized: The broker refuses the token.
            BrokerUnreachable: There is no broker now, or it has ended the user's session.
            TooManyUsersError: `MAX_USERS` are active, or `MAX_OPENING` are being opened.
            NoUsersError: The broker has no access rules.
        """
        if not token.isascii() or len(token) > MAX_TOKEN_CHARACTERS:
            raise NotAuthorized(UNKNOWN)
        key = hashlib.sha256(token.encode()).digest()
        entry = self._entries.get(key)
        if entry is not None and entry.lost and not entry.uses:
            self._drop(key)
            entry = None
        if entry is None:
            entry = self._new_entry(key, token)
        entry.uses += 1
        if entry.expiry is not None:
            entry.expiry.cancel()
        try:
            workspace = await asyncio.shield(entry.opening)
            if entry.lost:
                raise BrokerUnreachable("There is no broker now, or it has ended this user's session")
            yield workspace
        finally:
            entry.uses -= 1
            if not entry.uses and self._entries.get(key) is entry:
                self._entries[key] = self._entries.pop(key)
                entry.expiry = asyncio.get_running_loop().call_later(IDLE_SEC, self._drop, key)

    async def close(self) -> None:
        """Close all workspaces."""
        for key in tuple(self._entries):
            self._drop(key)
        if self._closing:
            await asyncio.wait(self._closing)

    def _new_entry(self, key: bytes, token: str) -> _Entry:
        if sum(not each.opening.done() for each in self._entries.values()) >= MAX_OPENING:
            raise TooManyUsersError("Too many users are signing in; try again in a moment")
        if len(self._entries) >= MAX_USERS:
            unused = next((key for key, each in self._entries.items() if not each.uses), None)
            if unused is None:
                raise TooManyUsersError(f"{MAX_USERS} users are signed in already; try again later")
            self._drop(unused)
        entry = _Entry(asyncio.get_running_loop().create_task(self._open(token)))
        self._entries[key] = entry

        def opened(opening: asyncio.Task[Workspace]) -> None:
            if (opening.cancelled() or opening.exception() is not None) and self._entries.get(key) is entry:
                del self._entries[key]

        entry.opening.add_done_callback(opened)
        return entry

    async def _open(self, token: str) -> Workspace:
        observer = Observer(self._url, self._domain, token=token)
        try:
            await observer.__aenter__()
        except NotAuthorized as error:
            raise NotAuthorized(UNKNOWN) from error
        try:
            require_users(observer)
        except NoUsersError:
            await observer.__aexit__(None, None, None)
            raise
        return Workspace(observer)

    def _drop(self, key: bytes) -> None:
        entry = self._entries.pop(key)
        if entry.expiry is not None:
            entry.expiry.cancel()
        task = asyncio.get_running_loop().create_task(_close(entry.opening))
        self._closing.add(task)
        task.add_done_callback(self._closing.discard)


async def _close(opening: asyncio.Task[Workspace]) -> None:
    opening.cancel()
    await asyncio.wait([opening])
    if opening.cancelled() or opening.exception() is not None:
        return
    workspace = opening.result()
    await workspace.close()
    await workspace.observer.__aexit__(None, None, None)
