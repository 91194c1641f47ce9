"""Packages of interfaces get the type hashes that ROS 2's build computes."""

from __future__ import annotations

import importlib
import itertools
import sys
from typing import TYPE_CHECKING, Any

import pytest
from hypothesis import HealthCheck, given, settings

from actors.interfaces.action import action_types
from actors.interfaces.catalog import interfaces_of
from actors.interfaces.generator import generate
from actors.interfaces.message import Action, Service, type_hash, type_name
from actors.interfaces.registry import find_interface
from tests.real_ros.definition_texts import packages
from tests.real_ros.differences import agree

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from tests.real_ros.sides import Side

_NUMBERS = itertools.count()


def classes_of(cls: Any) -> Iterator[Any]:
    """Return an interface and all types that ROS 2 derives from it."""
    yield cls
    if issubclass(cls, Service):
        service: Any = cls
        yield from (service.Request, service.Response, service.Event)
    elif issubclass(cls, Action):
        action: Any = cls
        derived = action_types(cls)
        yield from (action.Goal, action.Result, action.Feedback, derived.feedback_message)
        for service in (derived.send_goal, derived.get_result):
            yield from classes_of(service)


def hashes_of(package: str, folder: Path, files: dict[str, str]) -> dict[str, str]:
    """Return the hashes of all types of a package that is generated and imported."""
    for path, text in files.items():
        file = folder / package / path
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8")
    generate(folder / package)
    importlib.invalidate_caches()
    classes = [each for name in interfaces_of(package) for each in classes_of(find_interface(name))]
    return {type_name(each): type_hash(each) for each in classes}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder on the import path, for any number of packages."""
    monkeypatch.syspath_prepend(tmp_path)
    return tmp_path


def compare(case: str, files: dict[str, str], folder: Path, real: Side) -> None:
    """Compare the hashes of a package."""
    package = f"probe{next(_NUMBERS)}_msgs"
    truth = real.call("packages.hashes", package, files)
    agree("package", case, real=truth, callboard=hashes_of(package, folder, files))
    for module in [name for name in sys.modules if name.partition(".")[0] == package]:
        del sys.modules[module]


# One folder for all examples is right: each has a package of its own.
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(files=packages())
def test_types_of_a_package_have_the_hashes_of_ros(files: dict[str, str], folder: Path, real: Side) -> None:
    """Messages, services and actions, and what is derived from them."""
    compare(str(files), files, folder, real)


@pytest.mark.parametrize("line", ["wstring<=7[] a", "wstring<=7[<=7] a", "string<=7[] a", "wstring<=7[2] a"])
def test_bounds_of_strings_are_not_those_of_their_sequence(line: str, folder: Path, real: Side) -> None:
    """Each has its own place in the hash."""
    compare(line, {"msg/Wide.msg": line}, folder, real)
