"""The default maintainer of a new package: from git, or from the login."""

from __future__ import annotations

import getpass
import re
import shutil
import subprocess
from typing import Final, NamedTuple

GIT_TIMEOUT_SEC: Final = 5.0
EMAIL: Final = re.compile(r"[^@\s<>]+@[^@\s<>]+\.[^@\s<>]+")
"""The email addresses that build tools accept."""


class Maintainer(NamedTuple):
    """A maintainer.

    Attributes:
        name: The name.
        email: The email address.
    """

    name: str
    email: str


def usual_maintainer() -> Maintainer:
    """Return git's user, as for a commit in the current directory; else the login name.

    Without an address in git's configuration, the address is a placeholder: LOGIN@todo.todo.
    """
    user = _user()
    email = _from_git("user.email")
    return Maintainer(
        _from_git("user.name") or user, email if EMAIL.fullmatch(email) else f"{user}@todo.todo"
    )


def _user() -> str:
    try:
        return re.sub(r"[\s@<>]+", "_", getpass.getuser())
    except (KeyError, OSError, ImportError):  # a user in a container may have no name
        return "todo"


def _from_git(key: str) -> str:
    """Return a value of git's configuration; empty without git or without the value."""
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
