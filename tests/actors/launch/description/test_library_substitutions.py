"""What texts stand for that the library knows."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from actors.launch.description.actions import SetParameter
from actors.launch.description.library_substitutions import (
    AnonName,
    Command,
    FileContent,
    FindExecutable,
    FindPackageShare,
    LaunchLogDir,
    Parameter,
)
from actors.launch.description.substitutions import (
    LaunchConfiguration,
    LaunchContext,
    PathJoinSubstitution,
    resolve,
)
from actors.launch.errors import LaunchError
from actors.launch.planning.settings import apply_setting
from tests.actors.launch.fake_library import FakeLibrary, scope

if TYPE_CHECKING:
    from actors.launch.description.substitutions import Text

ROBOT = LaunchConfiguration("robot")


def here() -> LaunchContext:
    """One in which something is set."""
    return scope(launch_configurations={"robot": "r2"}, environment={"PATH": "xacro:r2"}, folder="/launch")


@pytest.mark.parametrize(
    ("text", "meant"),
    [
        (Command(["xacro '", ROBOT, " a' size:=", ROBOT]), "xacro|r2 a|size:=r2 said"),
        (Command([FindExecutable(name="xacro"), " x"]), "/bin/xacro|x said"),
        (FindExecutable(ROBOT), "/bin/r2"),
        (PathJoinSubstitution([FindPackageShare(package=[ROBOT, "_description"]), "urdf"]), None),
        (FileContent(path=[ROBOT, ".urdf"]), "text of /launch/r2.urdf"),
        (FileContent("/etc/robot"), "text of /etc/robot"),
        (
            [AnonName("a"), " ", AnonName(name=ROBOT), " ", AnonName(["", "a"])],
            "a_unique_1 r2_unique_2 a_unique_1",
        ),
    ],
)
def test_each_stands_for_a_text(text: Text, meant: str | None, monkeypatch: pytest.MonkeyPatch) -> None:
    """A command is split as a shell does it, and its output ends without line ends."""
    monkeypatch.setattr(
        FakeLibrary, "output_of", lambda _, command, environment: f"{'|'.join(command)} said\r\n\n"
    )
    assert resolve(text, here()) == (meant if meant is not None else "/share/r2_description/urdf")


@pytest.mark.parametrize(
    ("value", "text"),
    [(1, "1"), (1.5, "1.5"), (True, "True"), ("hello", "hello"), ("7", "7"), ("", ""), ([1, 2], "[1, 2]")],
)
def test_a_parameter_is_what_set_parameter_has_set_last(value: Any, text: str) -> None:
    """Truth values as Python writes them, as in ROS 2; a string without its quotes."""
    scope = here()
    apply_setting(SetParameter("a", "first"), scope)
    apply_setting(SetParameter("a", value), scope)
    assert (
        resolve([Parameter("a"), Parameter("b", ROBOT), LaunchLogDir()], scope)
        == f"{text}r2/log/of/this/launch"
    )
    with pytest.raises(LaunchError, match="No parameter 'b' has been set for all nodes"):
        resolve(Parameter("b"), scope)


def test_a_name_for_nobody_else_is_the_same_in_all_scopes() -> None:
    """Whoever asks first, so that a node can be remapped in one place and waited for in another."""
    outer = here()
    name = resolve(AnonName("talker"), outer.inner())
    assert resolve(AnonName("talker"), outer) == name
    assert resolve(AnonName("talker"), outer.inner().inner()) == name


@pytest.mark.parametrize(
    ("text", "error"),
    [
        (Command("echo '"), "'echo '' is not a command: No closing quotation"),
        (FindExecutable("none"), "No program 'none'"),
    ],
)
def test_what_is_not_there_is_an_error(text: Text, error: str) -> None:
    """Which says what it is."""
    with pytest.raises(LaunchError, match=error):
        resolve(text, here())
