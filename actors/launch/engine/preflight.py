"""Preflight checks: why a process cannot be started, before it is tried.

Each process begins as a shell of the guard, whose errors name the shell and not the program of the
description. The checks run when the process is due, because earlier processes may have created the files that
it needs. What only a start can show, such as a file that is not executable, is not checked.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Final

from actors.processes.outcome import Outcome
from proto.untrusted_text import escape

if TYPE_CHECKING:
    from actors.launch.planning.process_spec import ProcessSpec

NOT_FOUND_CODE: Final = 127
"""The exit code of shells for a program that does not exist."""


def preflight(spec: ProcessSpec) -> Outcome | None:
    """Return the outcome of a process that cannot be started; None if the checks find no reason.

    Args:
        spec: The process.
    """
    if reason := _illegal_character(spec):
        return Outcome(normal=False, reason=reason)
    if spec.cwd is not None and not _is_folder(spec.cwd):
        return Outcome(normal=False, reason=f"no folder '{escape(spec.cwd)}' to run it in")
    if _is_missing(spec):
        return Outcome(
            normal=False,
            reason=f"no program '{escape(spec.command[0])}'",
            exit_code=NOT_FOUND_CODE,
            returncode=NOT_FOUND_CODE,
        )
    return None


def _illegal_character(spec: ProcessSpec) -> str:
    """Return why no system accepts an argument or variable; an empty string if all are accepted."""
    # A function of the description has made it, or a substitution: the plan has not seen it.
    for word in spec.command:
        if "\0" in word:
            return f"null character in '{escape(word)}' of its command"
    for name, value in spec.environment.items():
        if not name or "=" in name or "\0" in name:
            return f"illegal name of an environment variable: '{escape(name)}'"
        if "\0" in value:
            return f"null character in the environment variable '{escape(name)}'"
    return ""


def _is_missing(spec: ProcessSpec) -> bool:
    if not hasattr(os, "killpg"):  # Windows also tries suffixes such as .exe
        return False
    here, program = spec.cwd or "", spec.command[0]
    if os.sep in program:
        return not _is_there(Path(here, program))
    path = spec.environment.get("PATH")
    if path is None:  # the shell has a default of its own
        return False
    return not any(_is_there(Path(here, each, program)) for each in path.split(os.pathsep))


def _is_folder(path: str) -> bool:
    return bool(path) and _is_there(Path(path)) and not Path(path).is_file()


def _is_there(path: Path) -> bool:
    try:
        path.stat()
    except (FileNotFoundError, NotADirectoryError, ValueError):
        return False
    except OSError:  # no permission to look: the start reports that
        return True
    return True
