"""Edits the text of access rules and keeps its comments and order. Pure.

Each edit is checked: the result must parse, and must differ from the original in nothing but the edit.
"""

from __future__ import annotations

import json
import re
import tomllib
from typing import TYPE_CHECKING, Any, Final

from broker.access.errors import AccessFileError
from broker.access.parse import is_user_name, parse_rules

if TYPE_CHECKING:
    from collections.abc import Sequence

NEW_FILE: Final = """\
# Access rules of a callboard broker: callboard broker --auth FILE
# docs/reference/access.md describes every key.

[roles.full]
allow.node = ["/**"]
allow.publish = ["/**"]
allow.subscribe = ["/**"]
allow.serve = ["/**"]
allow.call = ["/**"]
allow.see = ["/**"]
allow.administer = ["/**"]

[roles.observer]
allow.node = ["/**"]
allow.subscribe = ["/**"]
allow.see = ["/**"]

# Reads the broker's statistics, such as for /metrics.
[roles.monitor]
allow.administer = ["/**"]
"""

_HEADER: Final = re.compile(r"^[ \t]*\[", re.MULTILINE)
_TOKENS: Final = re.compile(r"^[ \t]*tokens[ \t]*=[ \t]*\[[^\]]*\]", re.MULTILINE)
_SPACE_AND_COMMENTS: Final = re.compile(r"(?:^[ \t]*(?:#.*)?\n)*\Z", re.MULTILINE)


def add_user(text: str, name: str, *, token: str, roles: Sequence[str], source: str) -> str:
    """Return the rules with one more user.

    Args:
        text: The rules.
        name: The user's name.
        token: The hash of the user's token.
        roles: Names of roles.
        source: The file, for errors.

    Raises:
        AccessFileError: The name is taken or invalid, there is no such role, or the rules are broken.
    """
    if not is_user_name(name):
        raise AccessFileError(f"A user cannot be called {name!r}: use at most 64 letters, digits, - and _")
    before = _load(text, source)
    users = before.setdefault("users", {})
    if name in users:
        raise AccessFileError(f"{source}: there is a user '{name}' already")
    users[name] = {"tokens": [token], "roles": list(roles)}
    after = text if text.endswith("\n") or not text else f"{text}\n"
    table = f"\n[users.{name}]\ntokens = {json.dumps([token])}\nroles = {json.dumps(list(roles))}\n"
    return _checked(after + table, before, source)


def remove_user(text: str, name: str, *, source: str) -> str:
    """Return the rules without a user.

    Args:
        text: The rules.
        name: The user's name.
        source: The file, for errors.

    Raises:
        AccessFileError: There is no such user, the rules need it (as `local.user`, or as the last
            one), or it has no table of its own.
    """
    before = _load(text, source)
    start, end = _table(text, before, name, source)
    del before["users"][name]
    return _checked(text[:start] + text[end:], before, source)


def set_tokens(text: str, name: str, tokens: Sequence[str], *, source: str) -> str:
    """Return the rules with other tokens of a user.

    Args:
        text: The rules.
        name: The user's name.
        tokens: The hashes of all tokens.
        source: The file, for errors.

    Raises:
        AccessFileError: There is no such user, or it has no table of its own.
    """
    before = _load(text, source)
    start, end = _table(text, before, name, source)
    line = f"tokens = {json.dumps(list(tokens))}"
    table, found = _TOKENS.subn(line, text[start:end], count=1)
    if not found:
        head, _, rest = text[start:end].partition("\n")
        table = f"{head}\n{line}\n{rest}"
    before["users"][name]["tokens"] = list(tokens)
    return _checked(text[:start] + table + text[end:], before, source)


def _table(text: str, data: dict[str, Any], name: str, source: str) -> tuple[int, int]:
    """Return the start and end of a user's table, without the comments that belong to the next table."""
    if name not in data.get("users", {}):
        raise AccessFileError(f"{source}: there is no user '{name}'")
    header = re.compile(rf"^[ \t]*\[[ \t]*users[ \t]*\.[ \t]*{re.escape(name)}[ \t]*\]", re.MULTILINE)
    found = header.search(text)
    if found is None:
        raise AccessFileError(f"{source}: '{name}' has no line [users.{name}]: change it by hand")
    further = _HEADER.search(text, found.end())
    if further is None:
        return found.start(), len(text)
    comments = _SPACE_AND_COMMENTS.search(text[: further.start()])
    return found.start(), comments.start() if comments is not None else further.start()


def _load(text: str, source: str) -> dict[str, Any]:
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise AccessFileError(f"{source}: {error}") from error


def _checked(text: str, expected: dict[str, Any], source: str) -> str:
    """Return the text if it parses to the expected rules; regular expressions may have cut elsewhere."""
    parse_rules(text, source)
    if tomllib.loads(text) != expected:
        raise AccessFileError(f"{source}: cannot change this text safely: change it by hand")
    return text
