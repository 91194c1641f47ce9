"""Access rules: any text is rules or an AccessFileError; patterns decide as a plain comparison does."""

from __future__ import annotations

from functools import cache
from ipaddress import ip_address
from typing import Final

from broker.access.errors import AccessFileError
from broker.access.origin import LOCAL, Origin
from broker.access.parse import parse_rules
from broker.access.patterns import PatternSet, pattern_fault
from broker.access.rules import Action
from proto.untrusted_text import escape

NAMES: Final = ("/a", "/a/b", "/a/b/c", "/b/a", "/secret", "/a/a/a/a/b")
FAR: Final = ip_address("10.1.2.3")
ORIGINS: Final = (LOCAL, Origin(address=FAR), Origin(address=None, client=FAR))
ALPHABET: Final = "/ab*_1."


def check(data: bytes) -> None:
    """Read a file and ask for decisions; compare a set of patterns."""
    text = data.decode("utf-8", "replace")
    try:
        rules = parse_rules(text, "rules.toml")
    except AccessFileError as error:
        assert str(error).startswith("rules.toml: ")  # noqa: PT017 - this is no test
        assert escape(str(error)) == str(error)  # noqa: PT017
    else:
        assert rules.users
        for user in rules.users:
            for origin in ORIGINS:
                principal = rules.principal(user, origin)
                assert principal is not None
                for action in Action:
                    for name in NAMES:
                        decision = principal.rights.decide(action, name)
                        assert decision.reason
                        assert principal.rights.may(action, name) == decision.allowed
                        if origin.client is not None and decision.allowed:
                            for each in ORIGINS[:2]:  # a claim only takes rights away
                                alone = rules.principal(user, each)
                                assert alone is not None
                                assert alone.rights.may(action, name)
        assert rules.authenticate(ORIGINS[1], "wrong") is None
    compare("".join(ALPHABET[byte % len(ALPHABET)] for byte in data[:60]).split("."))


def compare(texts: list[str]) -> None:
    """Compare what a set of patterns finds with what each pattern matches."""
    patterns = tuple(text for text in texts if not pattern_fault(text))
    found = PatternSet(patterns)
    for name in (*NAMES, *(text for text in texts if text.startswith("/"))):
        expected = any(matches(pattern[1:], name[1:]) for pattern in patterns)
        result = found.find(name)
        assert (result is not None) == expected, (patterns, name)
        assert result is None or result in patterns


def matches(pattern: str, name: str) -> bool:
    """Return whether a pattern matches a name, by trying all ways."""
    wanted, given = pattern.split("/"), name.split("/")

    @cache
    def at(place: int, token: int) -> bool:
        if place == len(wanted):
            return token == len(given)
        if wanted[place] == "**":
            return any(at(place + 1, end) for end in range(token, len(given) + 1))
        return token < len(given) and wanted[place] in {"*", given[token]} and at(place + 1, token + 1)

    return at(0, 0)
