"""Files that only their owner may read."""

from __future__ import annotations

import os
import stat
import subprocess
import sys
from typing import TYPE_CHECKING

import pytest

from broker.access.private_file import write_private
from proto.errors import CallboardError
from tests.system import fill_disk

if TYPE_CHECKING:
    from pathlib import Path


def test_written_files_are_private(tmp_path: Path) -> None:
    """Nobody else may read a new file; one may keep the permissions that somebody gave them."""
    file = tmp_path / "folder" / "f"
    write_private(file, "text")
    assert stat.S_IMODE(file.stat().st_mode) == 0o600
    assert stat.S_IMODE(file.parent.stat().st_mode) == 0o700
    file.chmod(0o640)
    write_private(file, "text", keep_mode=True)
    assert stat.S_IMODE(file.stat().st_mode) == 0o640
    write_private(file, "text")
    assert stat.S_IMODE(file.stat().st_mode) == 0o600
    assert list(file.parent.iterdir()) == [file]
    assert file.read_text() == "text"


def test_a_failed_write_leaves_the_file(tmp_path: Path) -> None:
    """And no temporary one."""
    (tmp_path / "f").mkdir()
    with pytest.raises(CallboardError, match="Cannot write"):
        write_private(tmp_path / "f", "text")
    assert [each.name for each in tmp_path.iterdir()] == ["f"]


def test_a_full_disk_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Case 42: no partial file, of the URL or of rules."""
    fill_disk(monkeypatch)
    with pytest.raises(CallboardError, match="No space left"):
        write_private(tmp_path / "url", "callboard://x")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.processes
def test_files_are_written_in_utf_8_whatever_the_locale(tmp_path: Path) -> None:
    """The rules are read in UTF-8, so a locale of another encoding must not decide how they are written."""
    file = tmp_path / "rules"
    program = "import sys; from pathlib import Path; from broker.access.private_file import write_private;"
    program += r" write_private(Path(sys.argv[1]), 'Jos\xe9')"
    plain = os.environ | {"LC_ALL": "C", "PYTHONCOERCECLOCALE": "0", "PYTHONUTF8": "0"}
    subprocess.run([sys.executable, "-c", program, file], env=plain, check=True, timeout=60)
    assert file.read_bytes() == "Jos\xe9".encode()
    assert list(tmp_path.iterdir()) == [file]


@pytest.mark.skipif(sys.platform == "win32", reason="files have no group there")
def test_a_rewritten_file_keeps_its_owner_and_group(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """`sudo callboard auth add` leaves the rules readable for the broker's group, if it has the right to."""
    given: list[tuple[int, int]] = []

    def chown(_: Path, owner: int, group: int) -> None:
        given.append((owner, group))
        raise PermissionError

    monkeypatch.setattr(os, "chown", chown)
    file = tmp_path / "rules"
    write_private(file, "before", keep_mode=True)
    assert not given
    write_private(file, "after", keep_mode=True)
    assert given == [(file.stat().st_uid, file.stat().st_gid)]
    assert file.read_text() == "after"
