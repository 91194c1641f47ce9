"""Packages of .msg, .srv and .action files, imported as they are."""

from __future__ import annotations

import importlib
import sys
from typing import TYPE_CHECKING, Any

import pytest

from actors.interfaces.errors import InterfaceSyntaxError
from actors.interfaces.message import type_name
from actors.interfaces.std_msgs.msg import Header
from actors.ros import finder

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path


@pytest.fixture(autouse=True)
def _own_modules(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Let the test import by the finder, and forget what it imports."""
    monkeypatch.setattr(sys, "meta_path", [finder.RosFinder(), *sys.meta_path])
    before = set(sys.modules)
    yield
    for name in set(sys.modules) - before:
        if name.startswith("lab_interfaces"):
            del sys.modules[name]


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """The folder of a package, as in a checkout."""
    files = {
        "msg/Sample.msg": "uint8 GOOD=1\nstd_msgs/Header header\nfloat64[] values\n",
        "srv/TakeSample.srv": "string sensor\n---\nSample sample\n",
        "action/Measure.action": "int32 count\n---\nSample[] samples\n---\nint32 left\n",
    }
    folder = tmp_path / "install" / "share" / "lab_interfaces"
    for name, text in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)
    return folder


def test_interfaces_are_imported_from_their_files(package: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """If the folder above them is on the import path."""
    monkeypatch.syspath_prepend(package.parent)
    messages: Any = importlib.import_module("lab_interfaces.msg")
    services: Any = importlib.import_module("lab_interfaces.srv")
    actions: Any = importlib.import_module("lab_interfaces.action")
    assert type_name(messages.Sample) == "lab_interfaces/msg/Sample"
    assert messages.Sample.GOOD == 1
    assert isinstance(services.TakeSample.Response().sample.header, Header)
    assert isinstance(services.TakeSample.Response().sample, messages.Sample)
    assert actions.Measure.Result.get_fields_and_field_types() == {
        "samples": "sequence<lab_interfaces/Sample>"
    }
    assert not hasattr(messages, "Other")
    with pytest.raises(ModuleNotFoundError):
        importlib.import_module("lab_interfaces.msg.other")


def test_interfaces_are_found_in_installed_prefixes(package: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In share of the folders in AMENT_PREFIX_PATH; a package on the import path comes first."""
    prefix = package.parent.parent
    monkeypatch.setenv("AMENT_PREFIX_PATH", f"{prefix / 'none'}:{prefix}")
    messages: Any = importlib.import_module("lab_interfaces.msg")
    assert type_name(messages.Sample) == "lab_interfaces/msg/Sample"
    assert finder.RosFinder().find_spec("asyncio", None) is None
    (prefix / "lab_interfaces.py").write_text("")
    monkeypatch.syspath_prepend(prefix)
    assert finder.RosFinder().find_spec("lab_interfaces", None) is None


def test_generated_packages_are_imported_as_they_are(package: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The files beside their modules are not read."""
    (package / "msg" / "__init__.py").write_text("Sample = 5\n")
    monkeypatch.syspath_prepend(package.parent)
    assert importlib.import_module("lab_interfaces.msg").Sample == 5
    assert finder.RosFinder().find_spec("lab_interfaces.msg", [str(package)]) is None
    assert finder.RosFinder().find_spec("lab_interfaces.other", [str(package)]) is None


def test_a_wrong_file_is_named(package: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With its line."""
    (package / "msg" / "Sample.msg").write_text("int32 a\nint33 b\n")
    monkeypatch.syspath_prepend(package.parent)
    with pytest.raises(InterfaceSyntaxError, match=r"Sample\.msg.*2"):
        importlib.import_module("lab_interfaces.msg")


def test_a_loader_knows_its_package_only(package: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What the package does not have is an ImportError."""
    monkeypatch.syspath_prepend(package.parent)
    spec = finder.RosFinder().find_spec("lab_interfaces.msg", [str(package)])
    assert spec is not None
    loader: Any = spec.loader
    with pytest.raises(ImportError, match=r"no lab_interfaces\.msg\._other"):
        loader.get_source("lab_interfaces.msg._other")
