"""Sources: which processes a file belongs to, and which folders are watched for that."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from actors.launch.engine import sources
from actors.launch.engine.sources import Sources
from actors.launch.planning.process_spec import ProcessSpec

if TYPE_CHECKING:
    from pathlib import Path


def process(label: str, *made_of: Path, script: Path | None = None) -> ProcessSpec:
    """Return a process that is made of something."""
    command = ("python", "-u", str(script)) if script is not None else ("program",)
    return ProcessSpec(
        label=label, name=label, command=command, shown=label, sources=tuple(map(str, made_of))
    )


@pytest.mark.parametrize(
    ("path", "counts"),
    [
        ("package/module.py", True),
        ("package/inner/module.py", True),
        ("package/parameters.yaml", True),
        ("package/parameters.yml", True),
        ("package/settings.toml", True),
        ("package/notes.md", False),
        ("package/module.pyc", False),
        ("package/.module.py.swp", False),
        ("package/.#module.py", False),
        ("package/__pycache__/module.py", False),
        ("package/.git/hook.py", False),
        ("package/venv/lib/module.py", False),
        ("package_too/module.py", False),
        ("elsewhere.py", False),
    ],
)
def test_what_counts_in_a_folder(tmp_path: Path, path: str, *, counts: bool) -> None:
    """Python, TOML and YAML; nothing that is hidden, generated or installed there."""
    made = Sources()
    made.add(process("one", tmp_path / "package"))
    assert made.labels_of(str(tmp_path.resolve() / path)) == (["one"] if counts else [])


def test_a_file_counts_by_its_name(tmp_path: Path) -> None:
    """Whatever it ends with; what links to it is watched where it really is."""
    real = tmp_path.resolve() / "map.bin"
    link = tmp_path / "link"
    link.symlink_to(real)
    made = Sources()
    made.add(process("one", link))
    assert made.labels_of(str(real)) == ["one"]
    assert made.folders() == [str(tmp_path.resolve())]


def test_a_script_is_its_own_processes_only(tmp_path: Path) -> None:
    """Two scripts share a folder: each starts again for itself, and both for a module of theirs."""
    folder = tmp_path.resolve()
    made = Sources()
    for name in ("talker", "listener"):
        made.add(process(name, folder, script=folder / f"{name}.py"))
    assert made.labels_of(str(folder / "talker.py")) == ["talker"]
    assert made.labels_of(str(folder / "common.py")) == ["talker", "listener"]


def test_folders_that_do_not_count_are_not_watched(tmp_path: Path) -> None:
    """They may be large."""
    for name in ("package/inner", "package/.git/objects", "package/venv/lib", "package/__pycache__"):
        (tmp_path / name).mkdir(parents=True)
    made = Sources()
    made.add(process("one", tmp_path / "package"))
    made.add(process("two", tmp_path / "package" / "inner"))
    made.add(process("three", tmp_path / "no" / "such.py"))
    folder = tmp_path.resolve() / "package"
    assert made.folders() == [str(folder), str(folder / "inner")]


def test_the_number_of_folders_has_a_limit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Somebody may have a script in his home folder."""
    monkeypatch.setattr(sources, "MAX_FOLDERS", 3)
    for number in range(9):
        (tmp_path / f"folder_{number}").mkdir()
    made = Sources()
    made.add(process("one", tmp_path))
    assert len(made.folders()) == 3


def test_a_process_is_taken_in_once(tmp_path: Path) -> None:
    """It starts often; one without sources never counts."""
    made = Sources()
    assert made.add(process("one", tmp_path))
    assert not made.add(process("one", tmp_path))
    assert not made.add(process("two"))
