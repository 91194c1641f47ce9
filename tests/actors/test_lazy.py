"""Imports that wait for the first use of their names."""

from __future__ import annotations

import builtins
import importlib
import sys
from typing import TYPE_CHECKING, Any

import pytest

from actors.lazy import lazy_imports

if TYPE_CHECKING:
    from pathlib import Path

PACKAGE = """
from actors.lazy import lazy_imports

with lazy_imports(__name__):
    from lazy_test_package.part import One as One, two as two
    from lazy_test_package.missing import Three as Three
"""


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    """A package with lazy names, just imported."""
    folder = tmp_path / "lazy_test_package"
    folder.mkdir()
    (folder / "__init__.py").write_text(PACKAGE)
    (folder / "part.py").write_text("class One: pass\ntwo = 2\n")
    monkeypatch.syspath_prepend(tmp_path)
    for name in ("lazy_test_package", "lazy_test_package.part"):
        monkeypatch.delitem(sys.modules, name, raising=False)
    return importlib.import_module("lazy_test_package")


def test_a_name_imports_its_module_when_it_is_used(package: Any) -> None:
    """Once: then it is an attribute like others. All names are listed before."""
    assert {"One", "two", "Three"} <= set(dir(package))
    assert "lazy_test_package.part" not in sys.modules
    assert package.two == 2
    assert package.One is sys.modules["lazy_test_package.part"].One
    assert vars(package)["two"] == 2


def test_an_error_comes_with_the_name(package: Any) -> None:
    """A module that is missing does not disturb the others."""
    with pytest.raises(ModuleNotFoundError, match=r"lazy_test_package\.missing"):
        _ = package.Three
    with pytest.raises(AttributeError, match="'lazy_test_package' has no attribute 'Four'"):
        _ = package.Four


def test_imports_elsewhere_are_real(package: Any) -> None:
    """Within a block those of other modules are, and after it all are."""
    before = builtins.__import__
    with lazy_imports(package.__name__):
        imported: Any = builtins.__import__("lazy_test_package.part", globals())
        assert imported.part.two == 2
    assert builtins.__import__ is before
