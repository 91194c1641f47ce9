"""`callboard auth`: users, tokens, and explained decisions."""

from __future__ import annotations

import json
import stat
import threading
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import pytest

from actors.cli.main import main
from broker.access import editing
from broker.access.files import load_rules
from broker.access.origin import LOCAL
from proto.aio import file_lock

if TYPE_CHECKING:
    from pathlib import Path


@pytest.fixture
def file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The default file, which does not exist yet."""
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    return tmp_path / "callboard" / "access.toml"


def test_a_token_is_printed_once_and_valid(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Stdout has the token and nothing else; the file has its hash only."""
    assert main(["auth", "add", "robot1", "--role", "full"]) == 0
    shown = capsys.readouterr()
    token = shown.out.strip()
    assert "The token is shown only now" in shown.err
    assert token not in shown.err + file.read_text()
    found = load_rules(file).authenticate(LOCAL, token)
    assert found is not None
    assert found.user == "robot1"
    assert stat.S_IMODE(file.stat().st_mode) == 0o600


def test_a_token_goes_into_a_private_file(
    file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Case 33: it appears nowhere else, whatever permissions an earlier file had."""
    out = tmp_path / "token"
    out.write_text("old")
    out.chmod(0o644)
    assert main(["auth", "add", "robot1", "--role", "full", "--token-file", str(out)]) == 0
    token = out.read_text().strip()
    shown = capsys.readouterr()
    assert stat.S_IMODE(out.stat().st_mode) == 0o600
    assert token not in shown.out + shown.err
    assert load_rules(file).authenticate(LOCAL, token) is not None


def test_without_a_role_a_user_may_do_nothing(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Nothing is opened by leaving something out, and the command says so."""
    assert main(["auth", "add", "guest"]) == 0
    assert "may do nothing" in capsys.readouterr().err
    assert main(["auth", "check", "guest", "see", "/x"]) == 1
    assert capsys.readouterr().out == "denied: users.guest has no roles\n"
    assert file.exists()


def test_a_new_token_adds_or_replaces(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """With --revoke the others end."""
    main(["auth", "add", "a", "--role", "full"])
    first = capsys.readouterr().out.strip()
    assert main(["auth", "token", "a"]) == 0
    second = capsys.readouterr().out.strip()
    assert all(load_rules(file).authenticate(LOCAL, token) for token in (first, second))
    assert main(["auth", "token", "a", "--revoke"]) == 0
    third = capsys.readouterr().out.strip()
    assert [bool(load_rules(file).authenticate(LOCAL, token)) for token in (first, second, third)] == [
        False,
        False,
        True,
    ]
    assert main(["auth", "token", "b"]) == 1
    assert "there is no user 'b'" in capsys.readouterr().err


def test_users_are_listed_and_removed(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Neither form shows a token or its hash."""
    for name in ("a", "b"):
        main(["auth", "add", name, "--role", "observer"])
    capsys.readouterr()
    assert main(["auth", "remove", "a"]) == 0
    capsys.readouterr()
    assert main(["auth", "list"]) == 0
    assert capsys.readouterr().out.split() == ["USER", "TOKENS", "ALSO", "BY", "ROLES", "b", "1", "observer"]
    assert main(["auth", "list", "--json"]) == 0
    user = {"name": "b", "tokens": 1, "certificates": [], "roles": ["observer"], "local": False}
    assert json.loads(capsys.readouterr().out) == [user]
    assert main(["auth", "remove", "b"]) == 1
    assert "has no users" in capsys.readouterr().err
    assert set(load_rules(file).users) == {"b"}


RULES = """
[local]
user = "robot1"

[users.robot1]
roles = ["driver"]

[roles.driver]
from = ["local", "10.0.0.0/8"]
allow.node = ["/robot1/*"]
allow.publish = ["/cmd_vel"]
"""


@pytest.mark.parametrize(
    ("arguments", "code", "text"),
    [
        ("publish /cmd_vel", 0, "allowed: roles.driver.allow.publish has '/cmd_vel'"),
        ("publish /cmd_vel --from 10.1.2.3", 0, "allowed: "),
        (
            "publish /cmd_vel --from 192.0.2.1",
            1,
            "denied: none of the roles of users.robot1 applies to 192.0.2.1",
        ),
        ("publish /cmd_vel --node /robot1/nav", 0, "allowed: "),
        (
            "publish /cmd_vel --node /other",
            1,
            "denied: no pattern matches in roles.driver.allow.node",
        ),
        ("publish /odom", 1, "denied: no pattern matches in roles.driver.allow.publish"),
    ],
)
def test_a_decision_is_explained(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], arguments: str, code: int, text: str
) -> None:
    """The exit code is the decision, the text names the entry."""
    file = tmp_path / "f"
    file.write_text(RULES)
    command = ["auth", "check", "robot1", *arguments.split(), "--file", str(file)]
    assert main(command) == code
    assert capsys.readouterr().out.startswith(text)
    assert main([*command, "--json"]) == code
    assert json.loads(capsys.readouterr().out)["allowed"] is (code == 0)


@pytest.mark.parametrize(
    ("arguments", "code", "text"),
    [
        ("robot2 publish /x", 1, "there is no user 'robot2'"),
        ("robot1 fly /x", 2, "fly"),
        ("robot1 publish x", 2, "must be absolute"),
        ("robot1 publish /x --from home", 2, "--from"),
    ],
)
def test_a_question_that_makes_no_sense_is_an_error(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], arguments: str, code: int, text: str
) -> None:
    """It is not answered with "denied"."""
    file = tmp_path / "f"
    file.write_text(RULES)
    assert main(["auth", "check", *arguments.split(), "--file", str(file)]) == code
    shown = capsys.readouterr()
    assert text in shown.err
    assert not shown.out


def test_no_file_is_an_error(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Case 34: without rules the error names the command that makes some."""
    for command in (["list"], ["remove", "a"], ["token", "a"], ["check", "a", "see", "/x"]):
        assert main(["auth", *command]) == 1
        error = f"There are no access rules in {file}: `callboard auth add` writes the file\n"
        assert capsys.readouterr().err == error
    assert not file.exists()


def test_edits_at_the_same_time_keep_each_other(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The second edit reads the file when the first has written it, not while both change the same text."""
    main(["auth", "add", "first"])
    both, change = threading.Barrier(2), editing.add_user

    def changed_together(*arguments: Any, **options: Any) -> str:
        text = change(*arguments, **options)
        with suppress(threading.BrokenBarrierError):
            both.wait(0.3)  # with a lock the other edit never gets here; without, both have the same text
        return text

    monkeypatch.setattr(editing, "add_user", changed_together)
    edits = [threading.Thread(target=main, args=(["auth", "add", name],)) for name in ("a", "b")]
    for each in edits:
        each.start()
    for each in edits:
        each.join()
    assert set(load_rules(file).users) == {"first", "a", "b"}
    assert not both.n_waiting
    assert stat.S_IMODE(file.stat().st_mode) == 0o600


def test_an_edit_does_not_wait_for_ever(
    file: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """If another process keeps the lock, the command says so and changes nothing."""
    main(["auth", "add", "first"])
    monkeypatch.setattr(file_lock, "LOCK_TIMEOUT_SEC", 0.0)
    with file_lock.hold_lock(str(file)):
        assert main(["auth", "add", "second"]) == 1
    assert "another process is changing" in capsys.readouterr().err
    assert set(load_rules(file).users) == {"first"}
