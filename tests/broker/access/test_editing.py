"""Edits of access rules: comments stay, nothing else changes, and a result that is broken is not written."""

from __future__ import annotations

import tomllib

import pytest

from broker.access.credentials import hash_token
from broker.access.editing import NEW_FILE, add_user, remove_user, set_tokens
from broker.access.errors import AccessFileError
from broker.access.files import new_token
from broker.access.parse import parse_rules

ONE, TWO = hash_token("one"), hash_token("two")
TEXT = f"""# the rules of the lab
[local]
user = "b"

[users.a]  # the first
# of a
tokens = [
    "{ONE}",  # the old one
]
roles = ["r"]

# about b
[users.b]
roles = ["r"]

[roles.r]  # the role
allow.see = ["/**"]
"""


def test_a_user_is_added_at_the_end() -> None:
    """The text before is unchanged."""
    changed = add_user(TEXT, "c", token=TWO, roles=["r"], source="f")
    assert changed.startswith(TEXT)
    assert parse_rules(changed, "f").users["c"].tokens == (TWO,)
    assert add_user(TEXT.rstrip(), "c", token=TWO, roles=[], source="f")


def test_a_new_file_has_roles_to_choose_from() -> None:
    """And no user until one is added."""
    changed = add_user(NEW_FILE, "a", token=ONE, roles=["full"], source="f")
    assert set(parse_rules(changed, "f").roles) == {"full", "observer", "monitor"}
    with pytest.raises(AccessFileError, match="no users"):
        parse_rules(NEW_FILE, "f")


def test_a_user_is_removed_with_his_own_lines_only() -> None:
    """Comments of others stay."""
    changed = remove_user(TEXT, "a", source="f")
    assert set(parse_rules(changed, "f").users) == {"b"}
    assert "of a" not in changed
    for kept in ("# the rules of the lab", "# about b", "# the role"):
        assert kept in changed
    last = add_user(TEXT, "z", token=TWO, roles=[], source="f")
    assert tomllib.loads(remove_user(last, "z", source="f")) == tomllib.loads(TEXT)


def test_tokens_are_replaced_in_their_place() -> None:
    """Also if a user has none yet."""
    changed = set_tokens(TEXT, "a", [ONE, TWO], source="f")
    assert parse_rules(changed, "f").users["a"].tokens == (ONE, TWO)
    assert "# of a" in changed
    assert parse_rules(set_tokens(TEXT, "b", [TWO], source="f"), "f").users["b"].tokens == (TWO,)


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        (TEXT.replace("[users.a]", '[users."a"]'), "change it by hand"),
        (f"users.a = {{ tokens = ['{ONE}'] }}\n[users.b]", "change it by hand"),
        (TEXT.replace('user = "b"', 'user = "a"'), "local.user must be one"),
        ("[users.a]\n", "has no users"),
        ("[users.b]\n", "there is no user 'a'"),
        ("[users.a", "f: "),
    ],
)
def test_what_cannot_be_removed_safely_is_refused(text: str, fault: str) -> None:
    """The error says why; nothing is guessed."""
    with pytest.raises(AccessFileError, match=fault):
        remove_user(text, "a", source="f")


def test_a_string_that_looks_like_a_table_is_not_edited() -> None:
    """The result would be valid, but another user's certificate would have changed."""
    decoy = f'[users.b]\ncertificates = ["""\n[users.a]\ntokens = ["{TWO}"]\n"""]\n\n[users.a]\ntokens = []\n'
    assert set(parse_rules(decoy, "f").users) == {"a", "b"}
    with pytest.raises(AccessFileError, match="change it by hand"):
        set_tokens(decoy, "a", [ONE], source="f")


@pytest.mark.parametrize(
    ("name", "roles", "fault"),
    [
        ("a", [], "there is a user 'a' already"),
        ("a b", [], "cannot be called"),
        ("x]\n[roles.y", [], "cannot be called"),
        ("", [], "cannot be called"),
        ("c", ["admin"], "no role 'admin'; the file has r"),
    ],
)
def test_what_cannot_be_added_is_refused(name: str, roles: list[str], fault: str) -> None:
    """A name is no way to write something else into the file."""
    with pytest.raises(AccessFileError, match=fault):
        add_user(TEXT, name, token=TWO, roles=roles, source="f")


def test_tokens_are_long_and_different() -> None:
    """256 bits behind a prefix that scanners for secrets recognise."""
    tokens = {new_token() for _ in range(100)}
    assert len(tokens) == 100
    assert all(token.startswith("cbt_") and len(token) == 47 for token in tokens)
