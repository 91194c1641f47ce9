"""The hook of packaging/callboard-ros: which names it waits for, and what it does for them."""

from __future__ import annotations

import ast
import re
import sys
from pathlib import Path

import pytest

from actors.ros import finder

FOLDER = Path(__file__).parents[3] / "packaging" / "callboard-ros"


@pytest.fixture(autouse=True)
def _installed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Run the `.pth` file as Python does at its start."""
    monkeypatch.setattr(sys, "meta_path", [*sys.meta_path])
    monkeypatch.syspath_prepend(FOLDER)
    exec((FOLDER / "callboard_ros.pth").read_text(), {})


def loaded() -> bool:
    """Return whether callboard's finder has been installed."""
    return any(isinstance(each, finder.RosFinder) for each in sys.meta_path)


@pytest.mark.parametrize("name", sorted(finder.module_names()))
def test_each_name_that_callboard_has_is_found(name: str) -> None:
    """By the hook, which then lets callboard's finder come first."""
    found = sys.meta_path[0].find_spec(name, None)
    assert found is not None
    assert isinstance(found.loader, finder.AliasLoader)
    assert isinstance(sys.meta_path[0], finder.RosFinder)


def test_names_that_are_not_those_of_ros_are_left_to_programs() -> None:
    """Such as a package beside the interface packages."""
    assert "std_msgs" in finder.module_names()
    assert "cdr" not in finder.module_names()


def test_it_waits_for_no_other_libraries() -> None:
    """Each library that the file names is one that callboard has."""
    (names,) = re.findall(r"name in (\{[^}]*\})", (FOLDER / "callboard_ros.pth").read_text())
    assert ast.literal_eval(names) == set(finder.LIBRARIES)


@pytest.mark.parametrize(("name", "path"), [("asyncio", None), ("package.rclpy", ["/"])])
def test_other_names_load_nothing(name: str, path: list[str] | None) -> None:
    """Neither those of others, nor modules in a package of somebody else."""
    assert sys.meta_path[0].find_spec(name, path) is None
    assert not loaded()


def test_what_callboard_does_not_have_is_left_to_others() -> None:
    """Such as an interface package of the user's own."""
    assert sys.meta_path[0].find_spec("no_such_msgs", None) is None


def test_it_does_nothing_beside_ros_2(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """If its rclpy is installed, no name is callboard's."""
    (tmp_path / "rclpy.py").touch()
    monkeypatch.syspath_prepend(tmp_path)
    assert sys.meta_path[0].find_spec("std_msgs", None) is None
    assert not loaded()
