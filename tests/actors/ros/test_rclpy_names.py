"""The table of rclpy's names agrees with the face, and the reference with the table."""

from __future__ import annotations

import ast
import importlib
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from actors.ros import rclpy
from tests.actors.ros.rclpy_names import reference, table
from tests.test_documents import document

if TYPE_CHECKING:
    from collections.abc import Iterator


FACE = Path(rclpy.__path__[0])


def has(module: str, name: str) -> bool:
    """Return whether the face has a name: an attribute, an annotated one, or one that `__init__` sets."""
    try:
        found: Any = importlib.import_module(f"actors.ros.{module}")
    except ImportError:
        return False
    for part in name.split("."):
        if not hasattr(found, part):
            if part in getattr(found, "__annotations__", ()):
                return True
            init = getattr(getattr(found, "__init__", None), "__code__", None)
            return init is not None and part in init.co_names
        found = getattr(found, part)
    return True


def modules() -> Iterator[tuple[str, Path]]:
    """Return the face's modules by rclpy's names."""
    for path in sorted(FACE.rglob("*.py")):
        parts = ("rclpy", *path.relative_to(FACE).with_suffix("").parts)
        yield ".".join(parts).removesuffix(".__init__"), path


def is_type_variable(value: ast.expr) -> bool:
    """Return whether an assignment makes a type variable, which is for annotations only."""
    return isinstance(value, ast.Call) and getattr(value.func, "id", "") in {"TypeVar", "ParamSpec"}


def public_names(tree: ast.AST, prefix: str = "") -> Iterator[str]:
    """Yield the public names that a module or class defines or offers again."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            found = [node.name]
        elif isinstance(node, ast.ImportFrom):
            found = [each.name for each in node.names if each.asname == each.name]
        elif isinstance(node, ast.Assign) and not is_type_variable(node.value):
            found = [each.id for each in node.targets if isinstance(each, ast.Name)]
        elif isinstance(node, ast.AnnAssign):
            found = [node.target.id] if isinstance(node.target, ast.Name) else []
        else:
            continue
        for name in found:
            if not name.startswith("_"):
                yield prefix + name
        if isinstance(node, ast.ClassDef) and not prefix and not node.name.startswith("_"):
            yield from public_names(node, f"{node.name}.")


@pytest.mark.parametrize("module", table())
def test_the_face_has_what_the_table_says(module: str) -> None:
    """What is the same or differs is there, what is absent is not."""
    statuses = table()[module]
    there = [*statuses.get("same", ()), *statuses.get("differs", ()), *statuses.get("own", ())]
    assert [name for name in there if not has(module, name)] == []
    assert [name for name in statuses.get("absent", ()) if has(module, name)] == []


def test_the_table_has_every_name_of_the_face() -> None:
    """A new module, class, function or method is entered in the table."""
    names = {
        module: {name for each in statuses.values() for name in each} for module, statuses in table().items()
    }
    own = {module for module, statuses in table().items() if not statuses}
    for module, path in modules():
        if module in own or module == "rclpy._rclpy_pybind11":
            continue
        assert module in names, f"enter {module} in rclpy_names.yaml"
        found = set(public_names(ast.parse(path.read_text(encoding="utf-8"))))
        assert sorted(found - names[module]) == [], f"enter these of {module} in rclpy_names.yaml"


def test_what_differs_is_explained() -> None:
    """Each name that differs or is absent says what, or why; no name has two statuses."""
    for module, statuses in table().items():
        for status in ("differs", "absent"):
            assert all(statuses.get(status, {"": "x"}).values()), module
        names = [name for each in statuses.values() for name in each]
        assert len(names) == len(set(names)), module


def test_the_reference_matches_the_table() -> None:
    """After a change: python -m tests.actors.ros.rclpy_names > docs/reference/rclpy.md."""
    assert document("reference/rclpy.md") == reference()
