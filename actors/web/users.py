"""Workspaces for the users of a broker with access rules, so that each sees and does what the rules allow."""

from __future__ import annotations

import asyncio
import hashlib
from contextlib import asynccontextmanager
from typing import TYPE_CHECKING, Final, NamedTuple

from actors.errors import BrokerUnreachable, NotAuthorized
from actors.web import limits
from actors.web.observer import Observer
from actors.web.sign_ins import SignIns, TokenNotAcceptedError
from actors.web.workspace import Workspace
from proto.errors import CallboardError
from proto.limits import MAX_TOKEN_CHARACTERS
from proto.wire.addresses import owned_by_one

if TYPE_CHECKING:
    from collections.abc import AsyncGenerator, Callable

    from proto.wire.addresses import Address

IDLE_SEC: Final = 60.0
"""How long a workspace that nobody uses stays open."""

UNKNOWN: Final = "The broker knows no user with this token"
NOT_ACCEPTED: Final = "The broker has not accepted this token in time; if it is right, try again later"


class TooManyUsersError(CallboardError):
    """As many users as the server takes are signed in. Try again later."""


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


class _Key(NamedTuple):
    """Whose workspace it is.

    Attributes:
        token: The hash of the token.
        address: The address of the browser or program.
    """

    token: bytes
    address: Address


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
    """Workspaces by tokens and addresses: opened by the first request, shared by all, closed when unused.

    A workspace has its own connection to the broker, which knows the address: roles may depend on it.

    Args:
        own: The server's own observer, of the same broker and domain.
        on_wrong: Called with the address of each token that is not accepted.
    """

    def __init__(self, own: Observer, on_wrong: Callable[[Address], object]) -> None:
        self._own = own
        self._entries: dict[_Key, _Entry] = {}
        """The one used last at the end; without those that failed."""
        self._closing: set[asyncio.Task[None]] = set()
        self._sign_ins = SignIns(on_wrong)

    @asynccontextmanager
    async def workspace(self, token: str, address: Address) -> AsyncGenerator[Workspace]:
        """Use the workspace of a token's user.

        Args:
            token: As presented.
            address: The address of the browser or program: wrong tokens delay others of the same one only.

        Raises:
            NotAuthorized: The broker refuses the token.
            TokenNotAcceptedError: The broker does not answer about the token.
            BrokerUnreachable: There is no broker now, or it has ended the user's session.
            TooManyUsersError: `MAX_USERS` are active, or the user is at `MAX_USER_ADDRESSES` others.
            NoUsersError: The broker has no access rules.
        """
        if not token.isascii() or len(token) > MAX_TOKEN_CHARACTERS:
            raise NotAuthorized(UNKNOWN)
        key = _Key(hashlib.sha256(token.encode()).digest(), address)
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
            if entry.uses or self._entries.get(key) is not entry:
                pass
            elif not entry.opening.done():  # nobody waits for it any more
                self._drop(key)
            else:
                self._entries[key] = self._entries.pop(key)
                entry.expiry = asyncio.get_running_loop().call_later(IDLE_SEC, self._drop, key)

    async def close(self) -> None:
        """Close all workspaces."""
        for key in tuple(self._entries):
            self._drop(key)
        if self._closing:
            await asyncio.wait(self._closing)

    def _new_entry(self, key: _Key, token: str) -> _Entry:
        if sum(each.token == key.token for each in self._entries) >= limits.MAX_USER_ADDRESSES:
            text = f"This user is at {limits.MAX_USER_ADDRESSES} other addresses; try again in a minute"
            raise TooManyUsersError(text)
        entry = _Entry(asyncio.get_running_loop().create_task(self._open(key, token)))
        self._entries[key] = entry

        def opened(opening: asyncio.Task[Workspace]) -> None:
            if (opening.cancelled() or opening.exception() is not None) and self._entries.get(key) is entry:
                del self._entries[key]

        entry.opening.add_done_callback(opened)
        return entry

    async def _open(self, key: _Key, token: str) -> Workspace:
        async with self._sign_ins.attempt(key.token, owned_by_one(key.address)):
            own, client = self._own, str(key.address)
            observer = Observer(own.url, own.domain, token=token, client_address=client, worker=own.worker)
            try:
                await observer.__aenter__()
            except NotAuthorized as error:
                raise NotAuthorized(UNKNOWN) from error
            except BrokerUnreachable as error:
                if self._own.connected:  # there is a broker, and it answers others
                    raise TokenNotAcceptedError(NOT_ACCEPTED) from error
                raise
        try:
            require_users(observer)
            self._make_room()
        except (NoUsersError, TooManyUsersError):
            await observer.__aexit__(None, None, None)
            raise
        return Workspace(observer)

    def _make_room(self) -> None:
        """Find room for a user whom the broker knows. Those whom it does not know cost others nothing."""
        opened = {key: each for key, each in self._entries.items() if each.opening.done()}
        if len(opened) >= limits.MAX_USERS:
            unused = next((key for key, each in opened.items() if not each.uses), None)
            if unused is None:
                raise TooManyUsersError(f"{limits.MAX_USERS} users are signed in already; try again later")
            self._drop(unused)

    def _drop(self, key: _Key) -> None:
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
