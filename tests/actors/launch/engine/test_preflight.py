"""What is in the way of a process, and what is not."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

import pytest

from actors.launch.engine.preflight import preflight
from actors.launch.planning.process_spec import ProcessSpec

if TYPE_CHECKING:
    from pathlib import Path

pytestmark = pytest.mark.skipif(not hasattr(os, "killpg"), reason="programs are found in another way")


def spec(*command: str, cwd: str | None = None, **environment: str) -> ProcessSpec:
    """Return a process."""
    return ProcessSpec(
        label="x-1", name="x", command=command, shown=" ".join(command), cwd=cwd, environment=environment
    )


@pytest.fixture
def tool(tmp_path: Path) -> Path:
    """A program in a folder `bin`."""
    file = tmp_path / "bin" / "tool"
    file.parent.mkdir()
    file.write_text("#!/bin/sh\n")
    file.chmod(0o755)
    return file


def test_a_program_that_is_there_is_tried(tool: Path, tmp_path: Path) -> None:
    """By its path, seen from where it runs, or by its name on its PATH; also if the file is no program."""
    folder = str(tool.parent)
    there = (
        spec(str(tool)),
        spec("bin/tool", cwd=str(tmp_path)),
        spec("tool", PATH=f"/nowhere:{folder}"),
        spec("tool", PATH="bin", cwd=str(tmp_path)),
        spec("tool", PATH="/nowhere:", cwd=folder),
        spec("tool"),
    )
    assert [preflight(each) for each in there] == [None] * len(there)
    tool.chmod(0o644)
    assert preflight(spec("tool", PATH=folder)) is None


@pytest.mark.parametrize(
    "missing",
    [spec("tool", PATH="/nowhere"), spec("tool", PATH=""), spec("/nowhere/tool"), spec("./tool", cwd="/")],
)
def test_a_missing_program_ends_as_in_a_shell(missing: ProcessSpec) -> None:
    """With exit code 127, and its name."""
    outcome = preflight(missing)
    assert outcome is not None
    assert (outcome.normal, outcome.returncode, outcome.exit_code) == (False, 127, 127)
    assert outcome.reason == f"no program '{missing.command[0]}'"


@pytest.mark.parametrize(
    ("wrong", "reason"),
    [
        (spec("/bin/sh", cwd="/no/where"), "no folder '/no/where' to run it in"),
        (spec("/bin/sh", cwd=""), "no folder '' to run it in"),
        (spec("/bin/sh", cwd="/bin/sh"), "no folder '/bin/sh' to run it in"),
        (spec("/bin/sh", **{"a=b": "c"}), "illegal name of an environment variable: 'a=b'"),
        (spec("/bin/sh", **{"": "c"}), "illegal name of an environment variable: ''"),
        (spec("/bin/sh", A="x\0"), "null character in the environment variable 'A'"),
        (spec("/bin/sh", "a\0b"), r"null character in 'a\x00b' of its command"),
    ],
)
def test_what_no_system_takes_is_named(wrong: ProcessSpec, reason: str) -> None:
    """There is no exit code, as nothing has been run."""
    outcome = preflight(wrong)
    assert outcome is not None
    assert (outcome.normal, outcome.returncode, outcome.reason) == (False, None, reason)
