"""Tests of the package roots: what they promise is there, and loads lazily."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

import actors
import actors.launch
import actors.testing
import actors.threads
import broker
import callboard

if TYPE_CHECKING:
    from types import ModuleType


@pytest.mark.parametrize("package", [actors, actors.launch, actors.testing, actors.threads, broker])
def test_every_promised_name_exists(package: object) -> None:
    """Each name that type checkers see can be had at run time, from the module that checkers see it in."""
    source = Path(str(package.__file__)).read_text(encoding="utf-8")  # type: ignore[attr-defined]
    promised = [
        (node.module, alias.name)
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
        if alias.asname == alias.name
    ]
    assert promised
    for module, name in promised:
        assert name in dir(package)
        assert getattr(package, name) is getattr(sys.modules[str(module)], name)


def test_the_broker_has_the_names_that_it_promises() -> None:
    """Its two lists are the same: it cannot have `actors.lazy`, with which one is enough."""
    source = Path(str(broker.__file__)).read_text(encoding="utf-8")
    classes = {name for name in dir(broker) if isinstance(getattr(broker, name), type)}
    assert classes == {
        alias.name
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
        if alias.asname
    }


def test_an_unknown_name_is_an_attribute_error() -> None:
    """A typo gets Python's usual answer, and mypy's: it warns of a comment here that ignores nothing."""
    with pytest.raises(AttributeError, match="has no attribute 'Nod'"):
        actors.Nod  # type: ignore[attr-defined]  # noqa: B018
    with pytest.raises(AttributeError, match="has no attribute 'Brok'"):
        broker.Brok  # type: ignore[attr-defined]  # noqa: B018


def test_importing_actors_loads_no_part_of_it() -> None:
    """`import actors` alone is cheap: no module of the package is loaded but what loads the others."""
    code = "import sys, actors; print([m for m in sys.modules if m[:7] in ('actors.', 'msgspec')])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "['actors.lazy']"


@pytest.mark.parametrize(
    "package", [actors, actors.launch, actors.testing, actors.threads, broker, callboard]
)
def test_a_package_shows_its_public_names_alone(package: ModuleType) -> None:
    """`dir` and `__all__`, for editors and `import *`, have no helper and no import of the package's own."""
    names: list[str] = package.__all__
    assert set(names) == {name for name in dir(package) if not name.startswith("_")}
    assert not {"TYPE_CHECKING", "annotations", "lazy_imports", "import_module"} & set(names)


def test_callboard_has_the_names_of_actors_and_broker() -> None:
    """They are the same objects."""
    for package in (actors, broker):
        for name in package.__all__:
            assert getattr(callboard, name) is getattr(package, name)
    with pytest.raises(AttributeError, match="'callboard' has no attribute 'Nod'"):
        callboard.Nod  # type: ignore[attr-defined]  # noqa: B018


def test_importing_callboard_loads_nothing() -> None:
    """It costs less than `import actors`."""
    code = "import sys, callboard; print(sys.modules.keys() & {'actors', 'broker'})"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"


@pytest.mark.processes
def test_callboard_can_be_imported_above_a_checkout(tmp_path: Path) -> None:
    """Not the folder of that name in the current one, which Python would take for an empty namespace."""
    (tmp_path / "callboard" / "actors").mkdir(parents=True)
    code = "import callboard; print(callboard.Node.__name__)"
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "Node"
