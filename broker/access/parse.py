"""Reads access rules from TOML, strictly: an unknown key or value is an error that names its place. Pure.

An example, with every key:

    [local]
    user = "operator"        # who connections from this machine are without a token

    [users.operator]
    tokens = ["sha256:..."]
    certificates = ["operator.example.org"]
    roles = ["operators"]

    [roles.operators]
    from = ["local", "10.0.0.0/8"]
    allow.subscribe = ["/**"]
    deny.subscribe = ["/camera/**"]

    [mesh]                   # other brokers; without a key there is no limit
    import = ["fleet"]       # roles: what their nodes may do here
    export = ["fleet"]       # roles: what they may know of what the nodes here do
"""

from __future__ import annotations

import re
import tomllib
from ipaddress import ip_network
from typing import TYPE_CHECKING, Any, Final, cast

from broker.access.credentials import is_token_hash
from broker.access.errors import AccessFileError
from broker.access.patterns import PatternSet, pattern_fault
from broker.access.rules import AccessRules, Action, Rights, Role, User
from proto.untrusted_text import escape

if TYPE_CHECKING:
    from collections.abc import Iterable

    from broker.access.origin import Network

MAX_FILE_BYTES: Final = 4 * 1024 * 1024
"""Far above what ten thousand users need."""

MAX_CERTIFICATE_NAME: Final = 255

LOCAL: Final = "local"
"""Stands in `from` for connections by loopback and unix sockets."""

_NAME: Final = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,63}")
_SHOWN: Final = 60
_KINDS: Final[dict[type, str]] = {
    dict: "a table",
    list: "an array",
    str: "a string",
    bool: "a boolean",
    int: "an integer",
}


def is_user_name(name: str) -> bool:
    """Return whether a user or a role can have this name."""
    return _NAME.fullmatch(name) is not None


def parse_rules(text: str, source: str) -> AccessRules:
    """Return the rules in a string.

    Args:
        text: The content of a file.
        source: Its path, for errors.

    Raises:
        AccessFileError: It is not TOML, or breaks a rule of the format; the text names the place.
    """
    try:
        return _read(tomllib.loads(text))
    except RecursionError:
        raise AccessFileError(f"{source}: tables or arrays are nested too deeply") from None
    except AccessFileError as error:
        raise AccessFileError(f"{source}: {error}") from None
    except ValueError as error:
        raise AccessFileError(f"{source}: {escape(str(error))}") from error


def _read(data: dict[str, Any]) -> AccessRules:
    _check_keys(data, ("local", "users", "roles", "mesh"), "")
    roles = {name: _role(name, value) for name, value in _named(data, "roles")}
    users = {name: _user(name, value, roles) for name, value in _named(data, "users")}
    if not users:
        raise AccessFileError("it has no users: add one with `callboard auth add NAME --file FILE`")
    # Two users with one credential would be told apart by their order in the file.
    for key in ("tokens", "certificates"):
        _check_owners(users.values(), key)
    mesh = _table(data.get("mesh", {}), "mesh")
    _check_keys(mesh, ("import", "export"), "mesh.")
    imports, exports = (_mesh_rights(mesh, key, roles) for key in ("import", "export"))
    return AccessRules(users, roles, _local_user(data, users), imports, exports)


def _mesh_rights(mesh: dict[str, Any], key: str, roles: dict[str, Role]) -> Rights | None:
    if key not in mesh:
        return None
    names = _roles(mesh, key, "mesh", roles)
    for name, place in names.items():
        if not roles[name].everywhere:
            raise AccessFileError(f"{place}: the role {_quote(name)} has 'from', which is for connections")
    return Rights(tuple(roles[name] for name in names), f"mesh.{key} has no roles")


def _local_user(data: dict[str, Any], users: dict[str, User]) -> str:
    if "local" not in data:
        return ""
    table = _table(data["local"], "local")
    _check_keys(table, ("user",), "local.")
    user = table.get("user")
    if not isinstance(user, str) or user not in users:
        raise AccessFileError(f"local.user must be one of the users: {_list(users)}")
    return user


def _named(data: dict[str, Any], key: str) -> Iterable[tuple[str, Any]]:
    table = _table(data.get(key, {}), key)
    for name, value in table.items():
        if not is_user_name(name):
            raise AccessFileError(f"{key}.{_quote(name)}: a name has at most 64 letters, digits, - and _")
        yield name, value


def _user(name: str, value: object, roles: dict[str, Role]) -> User:
    where = f"users.{name}"
    table = _table(value, where)
    _check_keys(table, ("tokens", "certificates", "roles"), f"{where}.")
    tokens = _texts(table, "tokens", where)
    for token, place in tokens.items():
        if not is_token_hash(token):  # not quoted: it may be the token itself
            remedy = f"`callboard auth token {name}` makes one"
            raise AccessFileError(f"{place} is not 'sha256:' and 64 hexadecimal digits; {remedy}")
    certificates = _texts(table, "certificates", where)
    for certificate, place in certificates.items():
        if not certificate or len(certificate) > MAX_CERTIFICATE_NAME:
            text = f"a certificate's name has from 1 to {MAX_CERTIFICATE_NAME} characters"
            raise AccessFileError(f"{place}: {text}")
    own = _roles(table, "roles", where, roles)
    return User(name, tuple(tokens), tuple(certificates), tuple(own))


def _roles(table: dict[str, Any], key: str, where: str, roles: dict[str, Role]) -> dict[str, str]:
    """Return the names of roles in an array, each with its place for errors."""
    names = _texts(table, key, where)
    for name, place in names.items():
        if name not in roles:
            known = _list(roles) or "none"
            raise AccessFileError(f"{place}: there is no role {_quote(name)}; the file has {known}")
    return names


def _role(name: str, value: object) -> Role:
    where = f"roles.{name}"
    table = _table(value, where)
    _check_keys(table, ("from", "allow", "deny"), f"{where}.")
    origins = _texts(table, "from", where)
    if "from" in table and not origins:
        raise AccessFileError(
            f"{where}.from is empty: the role would never apply; leave it out for everywhere"
        )
    return Role(
        name,
        allow=_patterns(table, "allow", where),
        deny=_patterns(table, "deny", where),
        networks=tuple(_network(text, place) for text, place in origins.items() if text != LOCAL),
        local=LOCAL in origins,
        everywhere=not origins,
    )


def _network(text: str, where: str) -> Network:
    try:
        return ip_network(text)
    except ValueError as error:
        reason = escape(str(error))[:200]
        raise AccessFileError(f"{where}: {reason}; write '10.1.0.0/16', '10.1.2.3' or '{LOCAL}'") from error


def _patterns(role: dict[str, Any], key: str, where: str) -> dict[Action, PatternSet]:
    where = f"{where}.{key}"
    table = _table(role.get(key, {}), where)
    _check_keys(table, tuple(action.value for action in Action), f"{where}.")
    found: dict[Action, PatternSet] = {}
    for word in table:
        patterns = _texts(table, word, where)
        for pattern, place in patterns.items():
            if fault := pattern_fault(pattern):
                raise AccessFileError(f"{place}: {_quote(pattern)} is not a pattern: {fault}")
        found[Action(word)] = PatternSet(tuple(patterns))
    return found


def _check_owners(users: Iterable[User], key: str) -> None:
    owners: dict[str, str] = {}
    for user in users:
        for value in cast("tuple[str, ...]", getattr(user, key)):
            if value in owners:
                raise AccessFileError(
                    f"users.{user.name}.{key} and users.{owners[value]}.{key} have one in common"
                )
            owners[value] = user.name


def _table(value: object, where: str) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise AccessFileError(f"{where} must be a table, not {_kind(value)}")
    return cast("dict[str, Any]", value)


def _texts(table: dict[str, Any], key: str, where: str) -> dict[str, str]:
    """Return the strings in an array, each with its place for errors. They must differ; no array is empty."""
    where = f"{where}.{key}"
    value: object = table.get(key, [])
    if not isinstance(value, list):
        raise AccessFileError(f"{where} must be an array of strings, not {_kind(value)}")
    places: dict[str, str] = {}
    for number, text in enumerate(cast("list[object]", value)):
        place = f"{where}[{number}]"
        if not isinstance(text, str):
            raise AccessFileError(f"{place} must be a string, not {_kind(text)}")
        if text in places:
            raise AccessFileError(f"{place} is there twice: remove one")
        places[text] = place
    return places


def _check_keys(table: dict[str, Any], known: tuple[str, ...], where: str) -> None:
    for key in table:
        if key not in known:
            raise AccessFileError(
                f"{where}{_quote(key)} is not a known key here; use one of: {', '.join(known)}"
            )


def _kind(value: object) -> str:
    return _KINDS.get(type(value), type(value).__name__)


def _quote(text: str) -> str:
    return f"'{escape(text[:_SHOWN])}'"


def _list(names: Iterable[str]) -> str:
    return ", ".join(sorted(names)[:10])
