"""The names of ROS 2's packages: which module they give, and when the installed one wins."""

from __future__ import annotations

import importlib
import importlib.util
import subprocess
import sys
from importlib.machinery import PathFinder
from typing import TYPE_CHECKING, Any

import pytest

from actors.interfaces.checking import check_assignments
from actors.interfaces.std_msgs import msg as std_msgs_msg
from actors.ros import finder

if TYPE_CHECKING:
    from pathlib import Path

DEADLINE_SEC = 30


@pytest.fixture(autouse=True)
def _own_finders(monkeypatch: pytest.MonkeyPatch) -> None:
    """Forget what a test installs."""
    monkeypatch.setattr(sys, "meta_path", [*sys.meta_path])


def python(code: str, *, path: Path | None = None) -> str:
    """Run code in a new process that finds ROS 2's names; return what it prints."""
    given = f"import sys; sys.path.insert(0, {str(path)!r})\n" if path else ""
    program = f"{given}from actors.ros.finder import install\n{code}"
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, timeout=DEADLINE_SEC, check=False
    )
    return (done.stdout + done.stderr.rpartition("\n  File")[2].rpartition("\n\n")[2]).strip()


@pytest.mark.processes
def test_a_module_is_the_same_under_both_names() -> None:
    """Neither a module nor a class exists twice, whichever name comes first."""
    code = """install()
import std_msgs.msg, actors.interfaces.std_msgs.msg as ours
import rclpy.node, actors.ros.rclpy.node as node
from geometry_msgs.msg import Twist
print(std_msgs.msg is ours, std_msgs.msg.String is ours.String)
print(rclpy.node is node, node.Node.__module__)
print(ours.__spec__.name, sys.modules["std_msgs.msg"] is ours)"""
    assert python("import sys\n" + code).splitlines() == [
        "True True",
        "True actors.ros.rclpy.node",
        "actors.interfaces.std_msgs.msg True",
    ]


@pytest.mark.processes
def test_an_installed_interface_package_wins(tmp_path: Path) -> None:
    """A regular package is imported; a mere folder of that name is not."""
    (tmp_path / "std_msgs").mkdir()
    (tmp_path / "std_msgs" / "__init__.py").write_text("HERE = 1\n")
    (tmp_path / "nav_msgs").mkdir()
    code = "install()\nimport std_msgs, nav_msgs.msg; print(std_msgs.HERE, nav_msgs.msg.__name__)"
    assert python(code, path=tmp_path) == "1 actors.interfaces.nav_msgs.msg"


@pytest.mark.processes
def test_a_real_rclpy_is_hidden_only_by_force(tmp_path: Path) -> None:
    """Without `force` it is an error that says what to do."""
    (tmp_path / "rclpy.py").write_text("")
    assert "--force" in python("install()", path=tmp_path)
    assert python("install(force=True)\nimport rclpy; print(rclpy.__name__)", path=tmp_path) == (
        "actors.ros.rclpy"
    )


@pytest.mark.processes
def test_other_names_are_left_alone() -> None:
    """What callboard does not have is not found, also below a package that it has."""
    code = """install(); install()
import sys
for name in ("no_such_msgs", "rclpy.no_such_module"):
    try:
        __import__(name)
    except ModuleNotFoundError as error:
        print(error.name)
print(sum(type(each).__name__ == "RosFinder" for each in sys.meta_path))"""
    assert python(code).splitlines() == ["no_such_msgs", "rclpy.no_such_module", "1"]


@pytest.mark.parametrize("name", sorted(finder.UNSUPPORTED))
def test_a_library_that_is_absent_says_so(name: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """With what to do instead, unless it is installed."""
    found = finder.RosFinder()
    with pytest.raises(ModuleNotFoundError, match=f"callboard has no {name}: ") as caught:
        found.find_spec(name, None)
    assert caught.value.name == name
    (tmp_path / f"{name}.py").touch()
    monkeypatch.syspath_prepend(tmp_path)
    assert found.find_spec(name, None) is None


@pytest.mark.processes
def test_modules_are_attributes_of_rclpy() -> None:
    """`import rclpy` is enough for `rclpy.logging`; what there is not has rclpy's name in its error."""
    code = """install()
import rclpy
print(rclpy.logging.get_logger("x"), rclpy.qos.qos_profile_sensor_data.depth)
try:
    rclpy.none
except AttributeError as error:
    print(error)"""
    assert python(code).splitlines() == ["Logger('x') 5", "module 'rclpy' has no attribute 'none'"]


def test_a_finder_gives_aliases() -> None:
    """The module keeps its own spec; names that are not ROS's, or not there, are not found."""
    found = finder.RosFinder()
    spec = found.find_spec("std_msgs.msg", None)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    assert module is std_msgs_msg
    assert module.__spec__ is not None
    assert module.__spec__.name == "actors.interfaces.std_msgs.msg"
    assert found.find_spec("asyncio", None) is None
    assert found.find_spec("rclpy.none", None) is None


def test_a_finder_is_installed_once(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """First of all; not if ROS 2's rclpy is there, unless it is forced."""
    (tmp_path / "rclpy.py").write_text("")
    with monkeypatch.context() as patch:
        patch.syspath_prepend(tmp_path)
        with pytest.raises(finder.RealPackageError, match="--force"):
            finder.install()
        assert finder.RosFinder().find_spec("rclpy", None) is None
        forced = finder.RosFinder(force=True).find_spec("rclpy", None)
        assert forced is not None
    # Taken away afterwards: message classes change with the first import of a ROS package.
    monkeypatch.setattr(sys, "meta_path", [*sys.meta_path])
    finder.install()
    finder.install()
    assert [type(each).__name__ for each in sys.meta_path].index("RosFinder") == 0
    assert sum(isinstance(each, finder.RosFinder) for each in sys.meta_path) == 1


def test_a_module_is_looked_up_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """The loader imports the module by the spec that the finder has found."""
    found = finder.RosFinder()
    monkeypatch.setattr(sys, "meta_path", [found, *sys.meta_path])
    monkeypatch.delitem(sys.modules, "actors.interfaces.shape_msgs.msg", raising=False)
    importlib.import_module("actors.interfaces.shape_msgs")
    spec = found.find_spec("shape_msgs.msg", importlib.import_module("shape_msgs").__path__)
    looked_up = PathFinder.find_spec
    names: list[str] = []

    def counted(name: str, *args: Any) -> Any:
        names.append(name)
        return looked_up(name, *args)

    monkeypatch.setattr(PathFinder, "find_spec", counted)
    assert spec is not None
    assert spec.loader is not None
    assert spec.loader.create_module(spec) is sys.modules["actors.interfaces.shape_msgs.msg"]
    assert names == []


@pytest.mark.processes
def test_fields_are_checked_if_the_environment_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    """With ROS 2's variable, from the first import on; else a message takes what it gets."""
    code = """install()
import std_msgs.msg
try:
    print(std_msgs.msg.String(data=5))
except AssertionError as error:
    print(error)"""
    assert python(code) == "std_msgs.msg.String(data=5)"
    monkeypatch.setenv("ROS_PYTHON_CHECK_FIELDS", "1")
    assert python(code) == "The 'data' field must be of type 'str'"
    monkeypatch.setattr(finder, "_cached_names", None)
    assert finder.RosFinder().find_spec("std_msgs", None) is not None
    try:
        with pytest.raises(AssertionError):
            std_msgs_msg.String(data=5)  # type: ignore[arg-type]
    finally:
        check_assignments(enabled=False)
