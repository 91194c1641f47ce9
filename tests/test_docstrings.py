"""Each exported callable documents its arguments, its result and what it raises, in Google's style."""

from __future__ import annotations

import ast
import asyncio
import builtins
import importlib
import inspect
import pkgutil
import re
from enum import Enum
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import pytest

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

PACKAGES: Final = ("actors", "actors.launch", "actors.testing", "actors.threads", "broker")
"""Export what they import for type checkers."""
TOOLS: Final = "actors.tools"
"""Of its modules all that is public is exported."""
SECTION: Final = re.compile(r"^(Args|Attributes|Returns|Yields|Raises):\n((?:[ ]{4}.*\n?|\n)*)", re.MULTILINE)
DOCUMENTED: Final = re.compile(r"^    \*{0,2}([\w.]+(?:, \*{0,2}[\w.]+)*)(?: \([^)]*\))?:", re.MULTILINE)
CONSTRUCTORS: Final = {"__init__", "__post_init__"}
"""The docstring of their class documents them."""
ENTRIES: Final = {"__enter__", "__aenter__"}
UNDOCUMENTED: Final = NotImplementedError, AssertionError, StopIteration, StopAsyncIteration
"""For subclasses, for the developers, and for Python's own protocols."""
EXCEPTION_NAMES: Final[set[str]] = set()
"""Found so far: there are too many to look at all for each function."""


def exports(package: str) -> Iterator[tuple[str, Any]]:
    """Yield what a package exports, by qualified name."""
    module = importlib.import_module(package)
    if package != TOOLS:
        source = Path(str(module.__file__)).read_text(encoding="utf-8")
        for node in ast.walk(ast.parse(source)):
            for each in node.names if isinstance(node, ast.ImportFrom) else ():
                if each.asname == each.name:
                    yield f"{package}.{each.name}", getattr(module, each.name)
        return
    for found in pkgutil.walk_packages(module.__path__, f"{TOOLS}."):
        module = importlib.import_module(found.name)
        for key, value in vars(module).items():
            if not key.startswith("_") and getattr(value, "__module__", "") == found.name:
                yield f"{found.name}.{key}", value


def callables(package: str) -> dict[str, tuple[Callable[..., Any], str]]:
    """Return functions, constructors and public methods, with the docstrings that have their parameters."""
    found: dict[str, tuple[Callable[..., Any], str]] = {}
    for name, value in exports(package):
        if inspect.isfunction(value):
            found[name] = value, inspect.getdoc(value) or ""
        elif inspect.isclass(value) and not issubclass(value, Enum | BaseException):
            found.update(_methods(name, value))
    return found


def _methods(name: str, cls: type) -> Iterator[tuple[str, tuple[Callable[..., Any], str]]]:
    # The fields of dataclasses have docstrings of their own, and only the node calls what it makes.
    generated = getattr(getattr(cls, "__dataclass_params__", None), "init", False)
    made = re.search(r"Made by `(Lifecycle)?Node(Thread)?\.", cls.__doc__ or "") is not None
    ready_made = generated or made or getattr(cls, "_is_protocol", False)
    # Methods of tuples, dicts and protocols from elsewhere are documented there.
    for key in dir(cls):
        if key.startswith("_") and key not in (ENTRIES | CONSTRUCTORS):
            continue
        if key in CONSTRUCTORS and (ready_made if key == "__init__" else key not in vars(cls)):
            continue
        owner = next(each for each in cls.__mro__ if key in vars(each))
        if owner.__module__.partition(".")[0] not in {"actors", "broker", "proto"}:
            continue
        member: Any = inspect.getattr_static(cls, key)
        member = getattr(member, "__func__", member)  # of a class or static method
        if inspect.isfunction(member):
            text = inspect.getdoc(cls if key in CONSTRUCTORS else member) or ""
            yield (name if key in CONSTRUCTORS else f"{name}.{key}"), (member, text)


def raised(function: Callable[..., Any]) -> set[str]:
    """Return the exceptions that leave the `raise` statements in a function's own body."""
    function = inspect.unwrap(function)
    tree = _functions(function.__code__.co_filename)[function.__code__.co_firstlineno]
    names = {**vars(builtins), **function.__globals__}
    for each in ast.walk(tree):
        if isinstance(each, ast.Import | ast.ImportFrom):
            exec(ast.unparse(each), names)  # those of the module are in its globals
    found = _raised(ast.iter_child_nodes(tree), names)
    return {each.__name__ for each in found if not issubclass(each, UNDOCUMENTED)}


@cache
def _functions(path: str) -> dict[int, ast.FunctionDef | ast.AsyncFunctionDef]:
    """Return the functions of a file by their first line, which is that of the first decorator."""
    return {
        min(each.lineno for each in (node, *node.decorator_list)): node
        for node in ast.walk(ast.parse(Path(path).read_text(encoding="utf-8")))
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
    }


def _raised(nodes: Iterable[ast.AST], names: dict[str, Any]) -> Iterator[type[BaseException]]:
    for node in nodes:
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            continue
        if isinstance(node, ast.Raise) and node.exc is not None:
            yield from _exceptions(node.exc, names)
        elif isinstance(node, ast.Try | ast.TryStar):
            caught = tuple(each for handler in node.handlers for each in _caught(handler, names))
            yield from (each for each in _raised(node.body, names) if not issubclass(each, caught))
            yield from _raised([*node.handlers, *node.orelse, *node.finalbody], names)
        else:
            yield from _raised(ast.iter_child_nodes(node), names)


def _caught(handler: ast.ExceptHandler, names: dict[str, Any]) -> Iterator[type[BaseException]]:
    """Yield what a handler catches and does not raise again."""
    if any(isinstance(each, ast.Raise) and each.exc is None for each in ast.walk(handler)):
        return
    if handler.type is None:
        yield BaseException
    else:
        yield from _exceptions(handler.type, names)


def _exceptions(node: ast.expr, names: dict[str, Any]) -> Iterator[type[BaseException]]:
    """Yield the classes that an expression names, calls, or calls a function for; none of a variable."""
    if isinstance(node, ast.Tuple):
        for each in node.elts:
            yield from _exceptions(each, names)
        return
    path = ast.unparse(node.func if isinstance(node, ast.Call) else node).split(".")
    if path[0] not in names and path[0].islower():
        return
    value = names[path[0]]
    for part in path[1:]:
        value = getattr(value, part)
    yield value if isinstance(value, type) else value.__globals__[value.__annotations__["return"]]


def _unknown(names: set[str]) -> set[str]:
    """Return the names that no exception has, of those that are imported by now."""
    if not names <= EXCEPTION_NAMES:
        EXCEPTION_NAMES.update(_exception_names())
    return names - EXCEPTION_NAMES


def _exception_names(base: type[BaseException] = BaseException) -> set[str]:
    return {base.__name__}.union(*(_exception_names(each) for each in base.__subclasses__()))


def _documented(text: str) -> set[str]:
    return {each.strip("* ") for names in DOCUMENTED.findall(text) for each in names.split(",")}


def shortcomings(function: Callable[..., Any], text: str) -> list[str]:
    """Return what a docstring does not say of a callable, and what it says of things that do not exist."""
    sections: dict[str, str] = dict(SECTION.findall(text))
    named = _documented("\n".join(sections.get(each, "") for each in ("Args", "Attributes")))
    parameters = {
        each
        for each in inspect.signature(function).parameters
        if each not in {"self", "cls"} and each[0] != "_"
    }
    wrong = [f"Args: {each} is missing" for each in sorted(parameters - named)]
    # The parameters of a dataclass are those of its generated `__init__`.
    args = _documented(sections.get("Args", "") if function.__name__ != "__post_init__" else "")
    wrong += [f"Args: there is no parameter {each}" for each in sorted(args - parameters)]
    errors = {each.rpartition(".")[2] for each in _documented(sections.get("Raises", ""))}
    wrong += [f"Raises: {each} is missing" for each in sorted(raised(function) - errors)]
    wrong += [f"Raises: there is no exception {each}" for each in sorted(_unknown(errors))]
    if not text:
        wrong.append("no docstring")
    returns = str(function.__annotations__.get("return", "None"))
    silent = returns in {"None", "Never", "NoReturn", "Self"} or function.__name__.startswith("__")
    # "Return the ..." in the first line is as good as a section, as ruff's DOC201 sees it.
    if (
        not silent
        and not re.match(r"(Return|Yield|Iterate)s?\b", text)
        and not sections.keys() & {"Returns", "Yields"}
    ):
        wrong.append("Returns is missing")
    return wrong


@pytest.mark.parametrize("package", [*PACKAGES, TOOLS])
def test_exported_callables_document_arguments_result_and_errors(package: str) -> None:
    """Each parameter has a line in Args, or in Attributes of its class, and each error one in Raises."""
    found = callables(package)
    assert found
    assert {name: wrong for name, each in found.items() if (wrong := shortcomings(*each))} == {}


def test_shortcomings_are_found() -> None:
    """A missing parameter, one that does not exist, and a missing result."""

    def function(a: int, *, b: int) -> int:
        return a + b

    assert shortcomings(function, "Add.\n\nArgs:\n    a: One.\n    c: None.\n") == [
        "Args: b is missing",
        "Args: there is no parameter c",
        "Returns is missing",
    ]
    assert not shortcomings(function, "Return the sum.\n\nArgs:\n    a: One.\n    b: Another.\n")


def test_undocumented_errors_are_found() -> None:
    """An error that leaves the function, also by a handler that raises again, and one that does not exist."""

    def too_long() -> OverflowError:
        return OverflowError()

    def function() -> None:
        def nested() -> None:
            raise KeyError

        try:
            nested()
            raise TimeoutError
        except OSError:
            pass
        try:
            raise asyncio.CancelledError
        except BaseException:
            too_long()
            raise
        if function:
            raise LookupError("Caught by nobody")

    text = "Do it.\n\nRaises:\n    LookupError: It fails.\n    NoSuchError: Never.\n"
    assert shortcomings(function, text) == [
        "Raises: CancelledError is missing",
        "Raises: there is no exception NoSuchError",
    ]
