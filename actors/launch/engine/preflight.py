"""Preflight: find out why a process cannot be started before trying.

The errors of the shell or the system name things that the description does not have. The check takes place
when the process is due, because earlier processes may have made what it needs. Errors that only a start
shows, such as a file that is no program, are not checked.
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
"""As shells have it."""


def preflight(spec: ProcessSpec) -> Outcome | None:
    """Return how a process ends that cannot even begin; None if nothing is known to be in its way."""
    if reason := _illegal(spec):
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


def _illegal(spec: ProcessSpec) -> str:
    """Say what no system takes, if there is anything."""
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
    if not hasattr(os, "killpg"):  # Windows: more than the name's file is looked for
        return False
    here, program = spec.cwd or "", spec.command[0]
    if os.sep in program:
        return not _is_there(Path(here, program))
    path = spec.environment.get("PATH")
    if path is None:  # the shell has one of its own then
        return False
    return not any(_is_there(Path(here, each, program)) for each in path.split(os.pathsep))


def _is_folder(path: str) -> bool:
    return bool(path) and _is_there(Path(path)) and not Path(path).is_file()


def _is_there(path: Path) -> bool:
    try:
        path.stat()
    except (FileNotFoundError, NotADirectoryError, ValueError):
        return False
    except OSError:  # no permission to look: starting it reports that
        return True
    return True
