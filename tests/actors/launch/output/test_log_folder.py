"""The folder of a launch's log files: private, bounded, and never another's."""

from __future__ import annotations

import os
import re
import stat
from typing import TYPE_CHECKING

import pytest

from actors.launch.output import log_folder as module
from actors.launch.output.log_folder import LATEST, LogFolder
from tests.seams.processes import open_files

if TYPE_CHECKING:
    from pathlib import Path

pytestmark = pytest.mark.skipif(os.name == "nt", reason="needs locks and links")


def old_folder(root: Path, day: int, *files: str) -> Path:
    """Make a folder as a launch of some day has left it."""
    path = root / f"2001-01-{day:02}T00-00-00Z-4711"
    path.mkdir()
    for name in files:
        (path / name).write_text("x")
    return path


def test_a_folder_is_made_for_its_owner_alone(tmp_path: Path) -> None:
    """Named by its time and process; two of the same second differ. `latest` is the newest."""
    root = tmp_path / "state" / "log"
    first, second = LogFolder(root), LogFolder(root)
    assert re.fullmatch(rf"\d{{4}}-\d\d-\d\dT\d\d-\d\d-\d\dZ-{os.getpid()}", first.path.name)
    assert first.path != second.path
    assert (root / LATEST).resolve() == second.path.resolve()
    first.write("launch.log", b"a\n")
    assert stat.S_IMODE(first.path.stat().st_mode) == 0o700
    assert stat.S_IMODE((first.path / "launch.log").stat().st_mode) == 0o600
    first.close()
    second.close()


def test_something_else_called_latest_stays(tmp_path: Path) -> None:
    """Whatever it is."""
    (tmp_path / LATEST).write_text("mine")
    LogFolder(tmp_path).close()
    assert (tmp_path / LATEST).read_text() == "mine"


def test_only_the_newest_folders_are_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Old ones go, but none that has something else in it, is no folder, is a link, or has another name."""
    monkeypatch.setattr(module, "MAX_FOLDERS", 2)
    gone = [old_folder(tmp_path, 1, "launch.log", "a-1-stdout.log.1"), old_folder(tmp_path, 2)]
    strange = old_folder(tmp_path, 3, "launch.log", "notes.txt")
    nested = old_folder(tmp_path, 4)
    (nested / "a.log").mkdir()
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    (elsewhere / "launch.log").write_text("x")
    link = tmp_path / "2001-01-05T00-00-00Z-1"
    link.symlink_to(elsewhere)
    (tmp_path / "2001-01-06T00-00-00Z-1").write_text("a file")
    kept = old_folder(tmp_path, 7, "launch.log")
    folder = LogFolder(tmp_path)
    assert not any(each.exists() for each in gone)
    assert sorted(each.name for each in strange.iterdir()) == ["launch.log", "notes.txt"]
    assert all(
        each.exists() for each in (nested / "a.log", elsewhere / "launch.log", link, kept, folder.path)
    )
    assert (tmp_path / "2001-01-06T00-00-00Z-1").exists()
    folder.close()


def test_the_folder_of_a_launch_that_runs_is_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """However old it is; when the launch has ended it may go."""
    monkeypatch.setattr(module, "MAX_FOLDERS", 1)
    first = LogFolder(tmp_path)
    second = LogFolder(tmp_path)
    assert first.path.exists()
    first.close()
    third = LogFolder(tmp_path)
    assert [each.path.exists() for each in (first, second, third)] == [False, True, True]
    second.close()
    third.close()


def test_a_file_that_grows_too_large_begins_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What was in it before is in `.1`; what was in that is gone."""
    monkeypatch.setattr(module, "MAX_FILE_BYTES", 4)
    folder = LogFolder(tmp_path)
    for data in (b"a\n", b"b\n", b"c\n", b"d\n", b"longer\n", b"e\n"):
        folder.write("x.log", data)
    folder.close()
    assert (folder.path / "x.log").read_bytes() == b"e\n"
    assert (folder.path / "x.log.1").read_bytes() == b"longer\n"


def test_many_files_are_not_all_open(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Those that were closed meanwhile go on where they ended, and know how large they are."""
    monkeypatch.setattr(module, "MAX_OPEN_FILES", 2)
    monkeypatch.setattr(module, "MAX_FILE_BYTES", 5)
    folder = LogFolder(tmp_path)
    for number in range(3):
        for name in ("a.log", "b.log", "c.log"):
            folder.write(name, b"%d\n" % number)
            assert open_files(folder) <= 2
    folder.close()
    assert (folder.path / "b.log.1").read_bytes() == b"0\n1\n"
    assert (folder.path / "b.log").read_bytes() == b"2\n"


def test_a_folder_that_cannot_be_made_is_an_error(tmp_path: Path) -> None:
    """The system says why."""
    (tmp_path / "file").touch()
    with pytest.raises(NotADirectoryError):
        LogFolder(tmp_path / "file" / "log")
