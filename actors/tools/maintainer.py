"""Maintainer: who makes a new package, as far as git and the system know."""

from __future__ import annotations

import getpass
import re
import shutil
import subprocess
from typing import Final, NamedTuple

GIT_TIMEOUT_SEC: Final = 5.0
EMAIL: Final = re.compile(r"[^@\s<>]+@[^@\s<>]+\.[^@\s<>]+")
"""What looks like an email address to the tools that build packages."""


class Maintainer(NamedTuple):
    """A name and an email address."""

    name: str
    email: str


def usual_maintainer() -> Maintainer:
    """Return who git says it is, as for a commit in the current directory; else who is logged in.

    Who has told git no address gets one that nobody takes for real: me@todo.todo.
    """
    user = _user()
    email = _from_git("user.email")
    return Maintainer(
        _from_git("user.name") or user, email if EMAIL.fullmatch(email) else f"{user}@todo.todo"
    )


def _user() -> str:
    try:
        return re.sub(r"[\s@<>]+", "_", getpass.getuser())
    except (KeyError, OSError, ImportError):  # a container's user may have no name
        return "todo"


def _from_git(key: str) -> str:
    """Return a value of git's configuration; nothing if there is no git or no value."""
    git = shutil.which("git")
    if git is None:
        return ""
    try:
        done = subprocess.run(  # noqa: S603 - no shell, and the key is ours
            [git, "config", key], capture_output=True, check=False, timeout=GIT_TIMEOUT_SEC
        )
    except (OSError, subprocess.TimeoutExpired):
        return ""
    text = done.stdout.decode(errors="replace").strip()
    return text if text.isprintable() else ""
