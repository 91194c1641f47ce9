"""Real ROS 2 is in its own environment, in the pinned versions; a side that does not answer says why."""

from __future__ import annotations

import subprocess
import tomllib
from importlib.machinery import PathFinder
from importlib.metadata import distributions
from typing import TYPE_CHECKING

import pytest

from tests.fork_server.client import forked
from tests.real_ros import REAL_PYTHON, ROOT
from tests.real_ros.sides import Domain, Side, SideError

if TYPE_CHECKING:
    from pathlib import Path

SURROUNDINGS = """
import os, sys
print("actors.cli.main" in sys.modules, any(name in sys.modules for name in ("rclpy", "pytest")))
libraries = sorted(os.environ.pop("LD_LIBRARY_PATH").split(":"))
print(libraries, sorted(os.environ.items()), sys.path, sys.prefix, sys.orig_argv)
"""


def test_versions_are_those_that_pyproject_pins(real: Side) -> None:
    """build/ros2 is not older than pyproject.toml."""
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    pins = dict(each.split("==") for each in extras["optional-dependencies"]["ros2"])
    installed = real.call("environment.versions")
    assert {name: installed.get(name) for name in pins} == pins


@pytest.mark.parametrize("module", ["rclpy", "rosidl_adapter", "rosidl_parser", "std_msgs", "rcl_interfaces"])
def test_tests_run_without_ros(module: str) -> None:
    """The environment of callboard's tests has nothing of ROS 2: the face would refuse to work."""
    assert PathFinder.find_spec(module) is None  # no other finder: the ROS face's knows some of these
    assert [each.name for each in distributions() if each.name.startswith("ros-")] == []


def test_a_forked_program_has_what_a_started_one_has() -> None:
    """Also the variables that Python sets when it starts there, such as the path of ROS 2's libraries."""
    real = str(REAL_PYTHON)
    outputs = [
        subprocess.run(
            [real, "-c", SURROUNDINGS], executable=each, check=True, capture_output=True, text=True
        )
        for each in (forked(real), None)
    ]
    (how, surroundings), (started, expected) = (each.stdout.splitlines() for each in outputs)
    assert (how, started) == ("True False", "False False")
    assert surroundings == expected


def test_a_side_that_is_not_there_says_what_to_do(tmp_path: Path) -> None:
    """Without build/ros2 each test fails with the remedy."""
    side = Side((str(tmp_path / "python"),), {})
    with pytest.raises(SideError, match="make test"):
        side.ask("environment.versions")
    side.close()


def test_a_side_that_dies_shows_its_stderr_and_starts_again() -> None:
    """The error has the end of its output; the next question has a new process."""
    side = Side(("/bin/sh", "-c", "echo so sad >&2; read line; test -e /nowhere"), {})
    for _ in range(2):
        with pytest.raises(SideError, match=r"ended with 1[^$]*so sad"):
            side.ask("environment.versions")
    side.close()


def test_what_a_function_raises_is_shown(real: Side) -> None:
    """`call` gives the traceback; `ask` the name of the exception."""
    with pytest.raises(SideError, match="AttributeError"):
        real.call("environment.nothing")
    assert real.ask("environment.nothing").raised[0] == "AttributeError"


def test_two_tests_have_two_domains() -> None:
    """A domain in use is skipped; one that was closed is free."""
    first = Domain(70)
    second = Domain(first.number)
    assert second.number != first.number
    first.close()
    second.close()
