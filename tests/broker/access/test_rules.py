"""Access rules: what a text may say, who it identifies, and what it decides."""

from __future__ import annotations

import itertools
from ipaddress import ip_address
from typing import TYPE_CHECKING

import pytest

from broker.access.credentials import hash_token
from broker.access.errors import AccessFileError
from broker.access.files import load_rules
from broker.access.origin import LOCAL, Origin
from broker.access.parse import MAX_FILE_BYTES, parse_rules
from broker.access.rules import MAX_DECISIONS, AccessRules, Action, Principal, Role, User
from proto.limits import MAX_TOKEN_CHARACTERS
from proto.wire.addresses import parse_address
from tests.seams.brokers import kept_decisions, kept_rights

if TYPE_CHECKING:
    from pathlib import Path

TOKEN = "cbt_" + "x" * 43
FAR = Origin(address=ip_address("10.1.2.3"))
LOOPBACK = Origin(address=ip_address("127.0.0.1"))

RULES = f"""
[local]
user = "watcher"

[users.robot]
tokens = ["{hash_token(TOKEN)}"]
certificates = ["robot.example.org"]
roles = ["driver", "careful"]

[users.watcher]
roles = ["onlooker"]

[users.nobody]
tokens = ["{hash_token("other")}"]

[roles.driver]
allow.publish = ["/robot1/**", "/estop"]
allow.subscribe = ["/robot1/*/pose"]
allow.node = ["/robot1/*"]

[roles.careful]
deny.publish = ["/robot1/secret/**"]

[roles.onlooker]
from = ["local", "10.0.0.0/8", "fd00::/8"]
allow.see = ["/**"]
"""


def rules() -> AccessRules:
    return parse_rules(RULES, "rules.toml")


def principal(user: str, origin: Origin = FAR) -> Principal:
    found = rules().principal(user, origin)
    assert found is not None
    return found


# Identity


def test_a_token_identifies_its_user() -> None:
    """A known token gives the user; an unknown, empty, huge or non-text one gives nobody."""
    found = rules().authenticate(FAR, TOKEN)
    assert found is not None
    assert found.user == "robot"
    for wrong in ("", TOKEN + "x", TOKEN[:-1], hash_token(TOKEN), "x" * (MAX_TOKEN_CHARACTERS + 1), "\ud800"):
        assert rules().authenticate(FAR, wrong) is None


def test_a_certificate_identifies_its_user() -> None:
    """One of the names in a client's certificate is enough; without any the connection is nobody's."""
    named = Origin(address=FAR.address, certificate_names=("unknown", "robot.example.org"))
    found = rules().authenticate(named, None)
    assert found is not None
    assert found.user == "robot"
    assert rules().authenticate(FAR, None) is None


@pytest.mark.parametrize("origin", [LOCAL, LOOPBACK, Origin(address=ip_address("::1"))])
def test_a_local_connection_is_the_local_user(origin: Origin) -> None:
    """Loopback and unix sockets without a token belong to `local.user`, and to nobody without that entry."""
    found = rules().authenticate(origin, None)
    assert found is not None
    assert found.user == "watcher"
    without = parse_rules(RULES.replace('[local]\nuser = "watcher"', ""), "rules.toml")
    assert without.authenticate(origin, None) is None


def test_who_has_no_token_keeps_the_identity_when_rules_are_read_again() -> None:
    """By certificate or machine, if the new rules still say so."""
    named = Origin(address=FAR.address, certificate_names=("robot.example.org",))
    for origin, user in ((LOCAL, "watcher"), (named, "robot")):
        before = rules().authenticate(origin, None)
        assert before is not None
        after = rules().renewed(before)
        assert after is not None
        assert after.user == user
        assert parse_rules("[users.other]", "rules.toml").renewed(before) is None


def test_a_wrong_token_does_not_fall_back_to_another_identity() -> None:
    """Neither the certificate nor `local.user` stands in for a wrong token."""
    local = Origin(address=None, certificate_names=("robot.example.org",))
    assert rules().authenticate(local, "wrong") is None


def test_an_ipv4_client_of_an_ipv6_socket_has_its_ipv4_address() -> None:
    """Networks and loopback apply to mapped addresses, and a zone is ignored."""
    assert parse_address("::ffff:10.1.2.3") == ip_address("10.1.2.3")
    assert Origin(address=parse_address("::ffff:127.0.0.1")).local
    assert parse_address("fe80::1%eth0") == ip_address("fe80::1")


# Decisions


@pytest.mark.parametrize(
    ("action", "name", "allowed"),
    [
        (Action.PUBLISH, "/robot1/cmd", True),
        (Action.PUBLISH, "/robot1/secret/cmd", False),
        (Action.PUBLISH, "/robot2/cmd", False),
        (Action.PUBLISH, "/estop", True),
        (Action.SUBSCRIBE, "/robot1/arm/pose", True),
        (Action.SUBSCRIBE, "/robot1/cmd", False),
        (Action.NODE, "/robot1/arm", True),
        (Action.NODE, "/robot2/arm", False),
        (Action.SERVE, "/robot1/cmd", False),
        (Action.CALL, "/robot1/cmd", False),
        (Action.SEE, "/robot1/cmd", False),
        (Action.ADMINISTER, "/robot1/cmd", False),
    ],
)
def test_deny_wins_and_nothing_is_allowed_by_default(action: Action, name: str, allowed: bool) -> None:
    """Each action has its own patterns; what a role denies no other role allows."""
    rights = principal("robot").rights
    assert rights.may(action, name) is allowed
    assert rights.may(action, name) is allowed, "the second time from memory"


def test_a_role_applies_from_its_addresses_only() -> None:
    """Another address has none of its rights."""
    assert principal("watcher", LOCAL).rights.may(Action.SEE, "/a")
    assert principal("watcher", LOOPBACK).rights.may(Action.SEE, "/a")
    assert principal("watcher", FAR).rights.may(Action.SEE, "/a")
    assert principal("watcher", Origin(address=ip_address("fd00::1"))).rights.may(Action.SEE, "/a")
    other = principal("watcher", Origin(address=ip_address("192.168.0.1"))).rights
    assert not other.may(Action.SEE, "/a")
    assert "192.168.0.1" in other.decide(Action.SEE, "/a").reason


CLAIMS = """
[local]
user = "u"
[users.u]
roles = ["near", "far", "all", "shy"]
[roles.near]
from = ["local"]
allow.publish = ["/near"]
deny.publish = ["/far"]
[roles.far]
from = ["10.0.0.0/8", "127.0.0.1"]
allow.publish = ["/far", "/shy"]
[roles.all]
allow.publish = ["/all"]
[roles.shy]
from = ["2001:db8::/32"]
deny.publish = ["/all"]
"""
PLACES = tuple(map(ip_address, ("127.0.0.1", "10.1.2.3", "10.9.9.9", "192.0.2.1", "2001:db8::7", "::1")))


def test_a_claimed_client_only_takes_rights_away() -> None:
    """Case 83: whatever a connection claims, it may do only what it and its client could do by themselves."""

    def allowed(origin: Origin) -> set[str]:
        found = parse_rules(CLAIMS, "rules.toml").principal("u", origin)
        assert found is not None
        return {each for each in ("/near", "/far", "/all", "/shy") if found.rights.may(Action.PUBLISH, each)}

    for address, client in itertools.product((None, *PLACES), PLACES):
        claimed = allowed(Origin(address=address, client=client))
        assert claimed <= allowed(Origin(address=address)) & allowed(Origin(address=client))
    assert allowed(Origin(address=None, client=PLACES[-1])) == {"/near", "/all"}
    assert allowed(Origin(address=PLACES[1], client=PLACES[2])) == {"/far", "/shy", "/all"}
    assert allowed(Origin(address=PLACES[1], client=PLACES[0])) == {"/shy", "/all"}
    assert allowed(Origin(address=PLACES[1], client=PLACES[3])) == {"/all"}
    assert allowed(Origin(address=PLACES[4], client=PLACES[3])) == set()


def test_a_connection_for_a_client_elsewhere_is_not_local() -> None:
    """Case 83: it is nobody's without a token, also when the rules are read again."""
    loaded = rules()
    for client, user in (("127.0.0.1", "watcher"), ("::1", "watcher"), ("10.1.2.3", ""), ("192.0.2.1", "")):
        for address in (None, LOOPBACK.address):
            found = loaded.authenticate(Origin(address=address, client=ip_address(client)), None)
            assert ("" if found is None else found.user) == user
            assert found is None or loaded.renewed(found) == found
    assert loaded.authenticate(Origin(address=FAR.address, client=LOOPBACK.address), None) is None


def test_a_refusal_names_the_client() -> None:
    """So that its reader knows which of the two addresses to look for."""
    origin = Origin(address=LOOPBACK.address, client=ip_address("192.0.2.1"))
    reason = principal("watcher", origin).rights.decide(Action.SEE, "/a").reason
    assert reason == "none of the roles of users.watcher applies to 127.0.0.1 for 192.0.2.1"


@pytest.mark.parametrize(
    ("user", "action", "name", "reason"),
    [
        ("robot", Action.PUBLISH, "/robot1/cmd", "roles.driver.allow.publish has '/robot1/**'"),
        ("robot", Action.PUBLISH, "/robot1/secret/x", "roles.careful.deny.publish has '/robot1/secret/**'"),
        (
            "robot",
            Action.CALL,
            "/x",
            "no pattern matches in roles.driver.allow.call, roles.careful.allow.call",
        ),
        ("nobody", Action.CALL, "/x", "users.nobody has no roles"),
    ],
)
def test_a_decision_names_its_rule(user: str, action: Action, name: str, reason: str) -> None:
    """The reason says which entry of the file decides, or what is missing."""
    assert principal(user).rights.decide(action, name).reason == reason


def test_equal_roles_are_equal_rights() -> None:
    """Connections with the same roles share their rights; others do not."""
    loaded = rules()
    one, two = loaded.principal("robot", FAR), loaded.principal("robot", LOCAL)
    assert one is not None
    assert two is not None
    assert one.rights is two.rights
    assert one.rights != principal("watcher").rights


def test_kept_decisions_are_limited() -> None:
    """A peer that asks for ever more names does not make the broker's memory grow."""
    rights = principal("robot").rights
    for number in range(MAX_DECISIONS + 10):
        rights.may(Action.PUBLISH, f"/robot1/t{number}")
    assert kept_decisions(rights) <= MAX_DECISIONS


def test_kept_rights_are_limited() -> None:
    """Nor do connections of ever more users with other roles."""
    roles = {name: Role(name, allow={}, deny={}) for name in "abcde"}
    many = AccessRules({name: User(name, roles=(name,)) for name in roles}, roles, max_rights=2)
    for name in roles:
        found = many.principal(name, FAR)
        assert found is not None
        assert kept_rights(many) <= 2


# The text


def test_a_file_of_any_size_is_not_read(tmp_path: Path) -> None:
    """Nor parsed: a file beyond the limit is an error."""
    file = tmp_path / "rules.toml"
    file.write_bytes(b"#" * (MAX_FILE_BYTES + 1))
    with pytest.raises(AccessFileError, match=f"longer than {MAX_FILE_BYTES} bytes"):
        load_rules(file)
    file.write_bytes(b"#" * MAX_FILE_BYTES)
    with pytest.raises(AccessFileError, match="it has no users"):
        load_rules(file)


def test_an_empty_file_is_an_error() -> None:
    """Case 34: nothing, or only comments, does not mean that everybody may do everything."""
    for text in ("", "# nothing\n", "[users]\n", "[roles.a]\nallow.see = ['/**']\n"):
        with pytest.raises(AccessFileError, match=r"rules.toml: it has no users: add one"):
            parse_rules(text, "rules.toml")


USER = "[users.a]\nroles = ['r']\n"
HASH = hash_token("x")


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("[users.a\n", "line 1"),
        ("users.a = 1\nusers.a = 2", "overwrite"),
        ("x = 1", "'x' is not a known key here; use one of: local, users, roles"),
        ("users = 1", "users must be a table, not an integer"),
        ("[users.'a b']", "users.'a b': a name has at most 64 letters"),
        ("users.a = []", "users.a must be a table, not an array"),
        ("[users.a]\nrole = ['r']", "users.a.'role' is not a known key here; use one of: tokens"),
        ("[users.a]\nroles = ['r']", r"users.a.roles\[0\]: there is no role 'r'; the file has none"),
        ("[users.a]\nroles = 'r'", "users.a.roles must be an array of strings, not a string"),
        ("[users.a]\nroles = [1]", r"users.a.roles\[0\] must be a string, not an integer"),
        ("[users.a]\ntokens = ['secret']", r"users.a.tokens\[0\] is not 'sha256:'"),
        (f"[users.a]\ntokens = ['{HASH}', '{HASH}']", r"users.a.tokens\[1\] is there twice"),
        (
            f"[users.a]\ntokens = ['{HASH}']\n[users.b]\ntokens = ['{HASH}']",
            "users.b.tokens and users.a.tokens",
        ),
        ("[users.a]\ncertificates = ['']", r"users.a.certificates\[0\]: a certificate's name"),
        ("[users.a]\ncertificates = ['x']\n[users.b]\ncertificates = ['x']", "users.b.certificates and"),
        (
            USER + "[roles.r]\nallows.see = []",
            "roles.r.'allows' is not a known key here; use one of: from, allow, deny",
        ),
        (
            USER + "[roles.r]\nallow.fly = []",
            "roles.r.allow.'fly' is not a known key here; use one of: publish",
        ),
        (
            USER + "[roles.r]\nallow.see = ['x']",
            r"roles.r.allow.see\[0\]: 'x' is not a pattern: it must begin",
        ),
        (USER + "[roles.r]\ndeny.see = ['/a*']", r"roles.r.deny.see\[0\]: '/a\*' is not a pattern: between"),
        (USER + "[roles.r]\nallow.see = ['/a', '/a']", r"roles.r.allow.see\[1\] is there twice"),
        (USER + "[roles.r]\nfrom = ['10.0.0.1/8']", r"roles.r.from\[0\]: 10.0.0.1/8 has host bits set"),
        (USER + "[roles.r]\nfrom = []", "roles.r.from is empty"),
        (USER + "[roles.r]\nfrom = ['Local']", r"roles.r.from\[0\]: 'Local' does not appear"),
        (USER + "[roles.r]\n[local]\nuser = 'b'", "local.user must be one of the users: a"),
        (USER + "[roles.r]\n[local]", "local.user must be one of the users: a"),
        (USER + "[roles.r]\nallow.see = ['\\u001b[2J']", "is not a pattern"),
        ("a = " + "[" * 100_000, "nested too deeply"),
    ],
)
def test_a_broken_file_is_an_error_that_names_the_place(text: str, fault: str) -> None:
    """Case 34: what is not understood is never skipped."""
    with pytest.raises(AccessFileError, match=fault) as caught:
        parse_rules(text, "rules.toml")
    assert str(caught.value).startswith("rules.toml: ")
    assert str(caught.value).isprintable()


def test_an_error_does_not_repeat_a_token() -> None:
    """Case 33: somebody who wrote the token itself into the file does not find it in the log."""
    with pytest.raises(AccessFileError) as caught:
        parse_rules(f"[users.a]\ntokens = ['{TOKEN}']", "rules.toml")
    assert TOKEN not in str(caught.value)


def test_rules_are_loaded_from_a_file(tmp_path: Path) -> None:
    """As their text says."""
    file = tmp_path / "rules.toml"
    file.write_text(RULES)
    assert load_rules(file).users.keys() == rules().users.keys()
