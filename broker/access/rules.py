"""Access rules: which user may do what. Pure.

A user has roles; a role has patterns of names for each action. What a role denies stays denied,
whatever other roles allow; what no role allows is denied. `parse.py` reads them from a file.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from typing import TYPE_CHECKING, Final, NamedTuple

from broker.access.credentials import TokenIndex
from broker.access.origin import is_local

if TYPE_CHECKING:
    from collections.abc import Mapping

    from broker.access.origin import Network, Origin
    from broker.access.patterns import PatternSet
    from proto.wire.addresses import Address

MAX_DECISIONS: Final = 10_000
"""Decisions that one set of rights caches. Peers choose the names, so beyond it the cache is emptied."""

MAX_RIGHTS: Final = 1000
"""Sets of rights that are cached for further connections, one for each combination of roles."""


class Action(Enum):
    """What a rule is about; the value is its word in the file."""

    PUBLISH = "publish"
    """Publish on a topic."""
    SUBSCRIBE = "subscribe"
    """Subscribe to a topic, and get its latched messages."""
    SERVE = "serve"
    """Offer a service."""
    CALL = "call"
    """Call a service."""
    SEE = "see"
    """See a node, topic or service in graph queries, with its type's definition and in notices."""
    ADMINISTER = "administer"
    """See the statistics of a node or topic."""
    NODE = "node"
    """Take a node name."""


class Decision(NamedTuple):
    """Whether something is allowed, and the rule that decides."""

    allowed: bool
    reason: str


@dataclass(frozen=True, slots=True, eq=False)
class Role:
    """A role: what it allows and denies, and where its users must connect from.

    Attributes:
        name: Its name.
        allow, deny: The patterns of each action.
        networks: Addresses from which it applies.
        local: Whether it applies to connections from this machine.
        everywhere: Whether it applies to all connections.
    """

    name: str
    allow: Mapping[Action, PatternSet]
    deny: Mapping[Action, PatternSet]
    networks: tuple[Network, ...] = ()
    local: bool = False
    everywhere: bool = True

    def applies(self, address: Address | None) -> bool:
        """Return whether it applies to an address; None is a unix socket's."""
        if self.everywhere or (self.local and is_local(address)):
            return True
        return address is not None and any(address in network for network in self.networks)


class Rights:
    """What the user of a connection may do. Two of them with the same roles are equal.

    Args:
        roles: The roles that apply.
        no_role: If no role applies: why, which is the reason of each refusal.
        denying: Further roles, of which only what they deny applies.
    """

    def __init__(self, roles: tuple[Role, ...], no_role: str = "", *, denying: tuple[Role, ...] = ()) -> None:
        self._roles = roles
        self._denying = denying
        self._no_role = no_role
        self._decisions: dict[tuple[Action, str], bool] = {}

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Rights):
            return False
        return self._roles == other._roles and self._denying == other._denying

    def __hash__(self) -> int:
        return hash((self._roles, self._denying))

    def may(self, action: Action, name: str) -> bool:
        """Return whether they allow an action on a name."""
        allowed = self._decisions.get((action, name))
        if allowed is None:
            if len(self._decisions) >= MAX_DECISIONS:
                self._decisions.clear()
            allowed = self._decisions[action, name] = self.decide(action, name).allowed
        return allowed

    def decide(self, action: Action, name: str) -> Decision:
        """Return whether they allow an action on a name, and why."""
        word = action.value
        # All denials before any permission: the order of roles must not matter.
        for role in (*self._roles, *self._denying):
            if (pattern := _find(role.deny, action, name)) is not None:
                return Decision(allowed=False, reason=f"roles.{role.name}.deny.{word} has '{pattern}'")
        for role in self._roles:
            if (pattern := _find(role.allow, action, name)) is not None:
                return Decision(allowed=True, reason=f"roles.{role.name}.allow.{word} has '{pattern}'")
        if not self._roles:
            return Decision(allowed=False, reason=self._no_role)
        entries = ", ".join(f"roles.{role.name}.allow.{word}" for role in self._roles)
        return Decision(allowed=False, reason=f"no pattern matches in {entries}")


def _find(patterns: Mapping[Action, PatternSet], action: Action, name: str) -> str | None:
    found = patterns.get(action)
    return None if found is None else found.find(name)


@dataclass(frozen=True, slots=True)
class Principal:
    """A user, connected from somewhere.

    Attributes:
        user: The user's name.
        rights: What the user may do from there.
        origin: Where the connection comes from.
        token: The hash of the token that has identified the user; "" if a certificate or the origin has.
    """

    user: str
    rights: Rights
    origin: Origin
    token: str = ""


@dataclass(frozen=True, slots=True)
class User:
    """A user.

    Attributes:
        name: The name.
        tokens: Hashes of the tokens.
        certificates: Names in client certificates that identify the user.
        roles: Names of the roles.
    """

    name: str
    tokens: tuple[str, ...] = ()
    certificates: tuple[str, ...] = ()
    roles: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class AccessRules:
    """The content of one file.

    Attributes:
        users: The users, by name.
        roles: The roles, by name.
        local_user: The user that connections from this machine are without credentials; "" for none.
        imports: What the nodes of other brokers may do here; None for everything.
        exports: What other brokers may know of the nodes here, by the action of these nodes; None for
            everything.
        max_rights: Combinations of roles whose rights are kept.
    """

    users: Mapping[str, User]
    roles: Mapping[str, Role]
    local_user: str = ""
    imports: Rights | None = None
    exports: Rights | None = None
    max_rights: int = MAX_RIGHTS
    _owners: Mapping[str, str] = field(init=False, repr=False, compare=False)
    _tokens: TokenIndex = field(init=False, repr=False, compare=False)
    _certificates: Mapping[str, str] = field(init=False, repr=False, compare=False)
    _rights: dict[tuple[tuple[Role, ...], tuple[Role, ...]], Rights] = field(
        init=False,
        repr=False,
        compare=False,
        default_factory=dict["tuple[tuple[Role, ...], tuple[Role, ...]]", Rights],
    )

    def __post_init__(self) -> None:
        tokens = {token: user.name for user in self.users.values() for token in user.tokens}
        certificates = {name: user.name for user in self.users.values() for name in user.certificates}
        object.__setattr__(self, "_owners", tokens)
        object.__setattr__(self, "_tokens", TokenIndex(tokens))
        object.__setattr__(self, "_certificates", certificates)

    def authenticate(self, origin: Origin, token: str | None) -> Principal | None:
        """Return the user of a connection.

        A token decides if there is one, then the certificate, then `local_user`. A wrong token identifies
        nobody, even if the certificate or `local_user` would identify somebody.

        Args:
            origin: Where it comes from.
            token: The token that it presents; None for none.

        Returns:
            The user with the rights from there, or None.
        """
        # A client that presents a token wants to be that user: falling back to another one would hide that
        # the token is wrong.
        if token is not None:
            user, stored = self._tokens.find(token)
            return self.principal(user, origin, token=stored)
        named = (self._certificates.get(name) for name in origin.certificate_names)
        user = next((name for name in named if name is not None), "")
        local = all(map(is_local, origin.addresses))
        return self.principal(user or (self.local_user if local else ""), origin)

    def renewed(self, principal: Principal) -> Principal | None:
        """Return the user of a connection by these rules, which were read after it was authenticated.

        Args:
            principal: The user by the earlier rules.

        Returns:
            The user with its rights now; None if its token, certificate or user is not valid any more.
        """
        if not principal.token:  # the certificate and the origin are kept, but not the token itself
            return self.authenticate(principal.origin, None)
        owner = self._owners.get(principal.token, "")
        return self.principal(owner, principal.origin, token=principal.token)

    def principal(self, user: str, origin: Origin, *, token: str = "") -> Principal | None:
        """Return a user as connected from somewhere; None if there is no such user."""
        found = self.users.get(user)
        return None if found is None else Principal(user, self._rights_of(found, origin), origin, token)

    def _rights_of(self, user: User, origin: Origin) -> Rights:
        addresses = origin.addresses
        named = [self.roles[name] for name in user.roles]
        roles = tuple(role for role in named if all(map(role.applies, addresses)))
        if not roles:
            if not user.roles:
                return Rights((), f"users.{user.name} has no roles")
            return Rights((), f"none of the roles of users.{user.name} applies to {origin}")
        # What a role denies to either address stays denied: nobody gets rid of it by claiming another client.
        denying = tuple(role for role in named if role not in roles and any(map(role.applies, addresses)))
        if len(self._rights) >= self.max_rights:
            self._rights.clear()
        key = roles, denying
        rights = self._rights.get(key)
        if rights is None:
            rights = self._rights[key] = Rights(roles, denying=denying)
        return rights
