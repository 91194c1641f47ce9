"""Modules, functions and classes stay small enough to be understood at once; exceptions have a reason."""

from __future__ import annotations

import ast
from pathlib import Path
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Iterator

ROOT: Final = Path(__file__).resolve().parent.parent
PACKAGES: Final = ("proto", "broker", "actors")
MAX_MODULE_LINES: Final = 400
MAX_FUNCTION_LINES: Final = 40
"""Without its docstring."""
MAX_METHODS: Final = 20
"""Names, so that a property's getter and setter count once."""

EXCEPTIONS: Final[dict[str, str]] = {
    "actors.callbacks.mailbox.Mailbox": "one state machine: who holds the node's callbacks, and who is next",
    "actors.launch.description.actions": "one class for each action, mostly their docstrings",
    "actors.launch.engine.machine": "one state machine with a method for each event and its effects",
    "actors.launch.engine.machine.Machine": "one state machine with a method for each event and its effects",
    "actors.node.graph_queries": "rclpy's graph queries, mostly docstrings",
    "actors.node.graph_queries.NodeGraph": "has rclpy's graph queries, one method each",
    "actors.node.node": "rclpy's surface, mostly docstrings",
    "actors.node.node.Node": "has rclpy's surface; its methods delegate",
    "actors.node.node.Node.__init__": "wires the node's parts",
    "actors.node.parameters.NodeParameters": "has rclpy's parameter methods; the store does the work",
    "actors.ros.rclpy.context.Context": "has rclpy's surface, and every way in which a context ends",
    "actors.ros.rclpy.executors": "rclpy's surface: a module with its three executors",
    "actors.ros.rclpy.executors.Executor": "has rclpy's surface; the work queue does the work",
    "actors.ros.rclpy.node": "rclpy's surface",
    "actors.ros.rclpy.node.Node": "has rclpy's surface; its methods delegate",
    "actors.ros.rclpy.node.Node.__init__": "rclpy's arguments, passed on",
    "actors.ros.rclpy.node_parameters.NodeParameters": "has rclpy's parameter methods, which delegate",
    "proto.wire.frames": "one table of all frames",
}
"""Modules, functions and classes beyond a limit, by qualified name, and why."""


def modules() -> Iterator[tuple[str, str]]:
    """Return the name and the source of each module that is not generated."""
    for package in PACKAGES:
        for path in (ROOT / package).rglob("*.py"):
            parts = path.relative_to(ROOT).with_suffix("").parts
            if parts[:2] == ("actors", "interfaces") and len(parts) > 3:
                continue  # generated
            yield ".".join(parts).removesuffix(".__init__"), path.read_text(encoding="utf-8")


def too_large(name: str, source: str) -> Iterator[tuple[str, str]]:
    """Return what of a module is beyond a limit, and by how much."""
    lines = source.count("\n")
    if lines > MAX_MODULE_LINES:
        yield name, f"{lines} lines, at most {MAX_MODULE_LINES}"
    yield from _too_large_in(ast.parse(source), name)


def _too_large_in(parent: ast.AST, prefix: str) -> Iterator[tuple[str, str]]:
    for child in ast.iter_child_nodes(parent):
        name = prefix
        if isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef):
            name = f"{prefix}.{child.name}"
            lines = _lines_without_docstring(child)
            if lines > MAX_FUNCTION_LINES:
                yield name, f"{lines} lines, at most {MAX_FUNCTION_LINES}"
        elif isinstance(child, ast.ClassDef):
            name = f"{prefix}.{child.name}"
            functions = (
                each for each in child.body if isinstance(each, ast.FunctionDef | ast.AsyncFunctionDef)
            )
            methods = len({each.name for each in functions})
            if methods > MAX_METHODS:
                yield name, f"{methods} methods, at most {MAX_METHODS}"
        yield from _too_large_in(child, name)


def _lines_without_docstring(function: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    lines = _lines(function)
    if ast.get_docstring(function, clean=False) is not None:
        lines -= _lines(function.body[0])
    return lines


def _lines(node: ast.stmt) -> int:
    assert node.end_lineno is not None
    return node.end_lineno - node.lineno + 1


def test_modules_functions_and_classes_stay_small() -> None:
    """What grows beyond a limit lacks a collaborator; an exception that is no longer needed goes."""
    found = {name: size for module in modules() for name, size in too_large(*module)}
    new = {name: size for name, size in found.items() if name not in EXCEPTIONS}
    assert not new, f"split these, or give a reason in EXCEPTIONS of {Path(__file__).name}"
    assert EXCEPTIONS.keys() <= found.keys(), "remove from EXCEPTIONS what is small enough now"


def test_each_limit_is_checked() -> None:
    """One line more than a limit, or one method, is found; what is at the limit is not."""
    function = "def f():\n    '''Do\n    nothing.'''\n" + "    pass\n" * (MAX_FUNCTION_LINES - 1)
    methods = "class C:\n" + "".join(f"    def m{each}(self): ...\n" for each in range(MAX_METHODS))
    module = "pass\n" * MAX_MODULE_LINES
    for source in (function, methods, module):
        assert not list(too_large("m", source))
    for source, name in ((function + "    pass\n", "m.f"), (methods + "    def n(self): ...\n", "m.C")):
        assert [each for each, _ in too_large("m", source)] == [name]
    assert [each for each, _ in too_large("m", module + "pass\n")] == ["m"]
