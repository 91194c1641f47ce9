"""Who makes a package."""

from __future__ import annotations

import getpass
import subprocess
from typing import TYPE_CHECKING

import pytest

from actors.tools.maintainer import usual_maintainer

if TYPE_CHECKING:
    from pathlib import Path


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A repository without a name in it, whatever this machine's git knows."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("GIT_CONFIG_GLOBAL", str(tmp_path / "none"))
    monkeypatch.setenv("GIT_CONFIG_SYSTEM", str(tmp_path / "none"))
    monkeypatch.setattr(getpass, "getuser", lambda: "ada")
    return tmp_path


def test_git_knows(folder: Path) -> None:
    """Its name and address, as for commits here."""
    subprocess.run(["git", "init", "-q"], check=True)
    subprocess.run(["git", "config", "user.name", "Ada Lovelace"], check=True)
    subprocess.run(["git", "config", "user.email", "ada@example.org"], check=True)
    assert usual_maintainer() == ("Ada Lovelace", "ada@example.org")


def test_git_without_a_name() -> None:
    """The login, and an address that is plainly to be replaced."""
    assert usual_maintainer() == ("ada", "ada@todo.todo")


def test_without_git(monkeypatch: pytest.MonkeyPatch) -> None:
    """The same."""
    monkeypatch.setenv("PATH", "")
    assert usual_maintainer() == ("ada", "ada@todo.todo")


def test_git_that_does_not_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    """It is not waited for beyond its limit."""

    def run(*command: object, timeout: float, **options: object) -> None:
        raise subprocess.TimeoutExpired("git", timeout)

    monkeypatch.setattr(subprocess, "run", run)
    assert usual_maintainer() == ("ada", "ada@todo.todo")


def test_a_user_without_a_name(monkeypatch: pytest.MonkeyPatch) -> None:
    """As in a container that runs under a number."""

    def getuser() -> str:
        raise KeyError(1234)

    monkeypatch.setattr(getpass, "getuser", getuser)
    assert usual_maintainer() == ("todo", "todo@todo.todo")


def test_a_login_with_a_space(monkeypatch: pytest.MonkeyPatch) -> None:
    """It makes an address all the same."""
    monkeypatch.setattr(getpass, "getuser", lambda: "Ada Lovelace")
    assert usual_maintainer() == ("Ada_Lovelace", "Ada_Lovelace@todo.todo")
