"""Stub files for ROS 2's names."""

from __future__ import annotations

from typing import TYPE_CHECKING

from actors.ros.finder import module_names
from actors.ros.stubs import main, write_stubs

if TYPE_CHECKING:
    from pathlib import Path

    import pytest


def test_every_package_has_a_stub(tmp_path: Path) -> None:
    """With the public names of its modules, and not those that it imports for itself."""
    files = write_stubs(tmp_path, suffix="-stubs")
    assert {path.name for path in tmp_path.iterdir()} == {f"{name}-stubs" for name in module_names()}
    assert all(path.is_file() for path in files)
    logging = (tmp_path / "rclpy-stubs/logging.pyi").read_text()
    assert "import RcutilsLogger as RcutilsLogger\n" in logging
    assert "import get_logger as get_logger\n" in logging
    assert "severity_from_name" not in logging
    assert "from . import node as node\n" in (tmp_path / "rclpy-stubs/__init__.pyi").read_text()
    assert "String as String\n" in (tmp_path / "std_msgs-stubs/msg/__init__.pyi").read_text()
    assert "qos_profile_default" in (tmp_path / "rclpy-stubs/qos.pyi").read_text()


def test_the_command_writes_into_a_folder(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """And says how many; other files there stay."""
    (tmp_path / "own.pyi").write_text("x: int\n")
    main([str(tmp_path)])
    assert capsys.readouterr().out.endswith(f"stub files in {tmp_path}\n")
    assert (tmp_path / "own.pyi").read_text() == "x: int\n"
    assert (tmp_path / "rclpy" / "node.pyi").is_file()
