"""Modules, functions and classes stay small enough to be understood at once; exceptions have a reason.

The sizes are guides. Docstrings and comments do not count, so that a "why" never costs a line of code. Past a
guide, look for the collaborator that is missing; if there is none, say so in `EXCEPTIONS`. Never split at the
tape measure: a module with one importer and no test of its own is worse than one that is a little long.
"""

from __future__ import annotations

import ast
from bisect import bisect_left, bisect_right
from pathlib import Path
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Iterator

ROOT: Final = Path(__file__).resolve().parent.parent
PACKAGES: Final = ("proto", "broker", "actors", "callboard")
MAX_MODULE_LINES: Final = 500
MAX_FUNCTION_LINES: Final = 50
MAX_METHODS: Final = 25
"""Names, so that a property's getter and setter count once."""

BLOCKS: Final = ("body", "orelse", "finalbody", "handlers", "cases")
"""Fields of nodes that are lists of statements, handlers or cases."""

EXCEPTIONS: Final[dict[str, str]] = {
    "actors.callbacks.mailbox.Mailbox": "one state machine: who holds the node's callbacks, and who is next",
    "actors.launch.engine.machine.Machine": "one state machine with a method for each event and its effects",
    "actors.node.graph_queries.NodeGraph": "has rclpy's graph queries, one method each",
    "actors.node.node.Node.__init__": "wires the node's parts",
    "actors.ros.rclpy.node.Node": "has rclpy's surface; its methods delegate",
    "proto.queues.publisher_queue.PublisherQueue": "one state machine: what waits, is dropped, may leave",
}
"""Modules, functions and classes beyond a guide, by qualified name, and why."""


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
    tree = ast.parse(source)
    counted = [*_counted_lines(tree, source)]
    if len(counted) > MAX_MODULE_LINES:
        yield name, f"{len(counted)} lines, at most {MAX_MODULE_LINES}"
    yield from _too_large_in(tree, name, counted)


def _too_large_in(parent: ast.AST, prefix: str, counted: list[int]) -> Iterator[tuple[str, str]]:
    for child in _blocks(parent):
        name = prefix
        if isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef):
            name = f"{prefix}.{child.name}"
            assert child.end_lineno is not None
            lines = bisect_right(counted, child.end_lineno) - bisect_left(counted, child.lineno)
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
        yield from _too_large_in(child, name, counted)


def _blocks(parent: ast.AST) -> Iterator[ast.AST]:
    """Return statements, handlers and cases of a node: no function or class is in an expression."""
    for name in BLOCKS:
        yield from getattr(parent, name, ())


def _counted_lines(tree: ast.Module, source: str) -> Iterator[int]:
    """Return the numbers of all lines but those of docstrings, of attributes too, and of comments."""
    docstrings: set[int] = set()
    left: list[ast.AST] = [tree]
    while left:
        node = left.pop()
        left += _blocks(node)
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            assert node.end_lineno is not None
            docstrings.update(range(node.lineno, node.end_lineno + 1))
    for number, line in enumerate(source.splitlines(), 1):
        if number not in docstrings and not line.lstrip().startswith("#"):
            yield number


def test_modules_functions_and_classes_stay_small() -> None:
    """What grows beyond a limit lacks a collaborator; an exception that is no longer needed goes."""
    found = {name: size for module in modules() for name, size in too_large(*module)}
    new = {name: size for name, size in found.items() if name not in EXCEPTIONS}
    assert not new, f"split these, or give a reason in EXCEPTIONS of {Path(__file__).name}"
    assert EXCEPTIONS.keys() <= found.keys(), "remove from EXCEPTIONS what is small enough now"


def test_each_limit_is_checked() -> None:
    """One line of code more than a limit, or one method, is found; what is at the limit is not."""
    function = (
        "def f():\n    '''Do\n    nothing.'''\n" + "    pass\n" * (MAX_FUNCTION_LINES - 1) + "    # why\n"
    )
    methods = "class C:\n" + "".join(f"    def m{each}(self): ...\n" for each in range(MAX_METHODS))
    module = "'''Nothing.'''\n# Why.\n" + "pass\n" * MAX_MODULE_LINES
    for source in (function, methods, module):
        assert not list(too_large("m", source))
    for source, name in ((function + "    pass\n", "m.f"), (methods + "    def n(self): ...\n", "m.C")):
        assert [each for each, _ in too_large("m", source)] == [name]
    assert [each for each, _ in too_large("m", module + "pass\n")] == ["m"]
