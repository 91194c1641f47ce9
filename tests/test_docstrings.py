"""Each exported callable documents its arguments and its result, in Google's style."""

from __future__ import annotations

import ast
import importlib
import inspect
import pkgutil
import re
from dataclasses import is_dataclass
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import pytest

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

PACKAGES: Final = ("actors", "actors.launch", "actors.testing", "broker")
"""Export what they import for type checkers."""
TOOLS: Final = "actors.tools"
"""Of its modules all that is public is exported."""
SECTION: Final = re.compile(r"^(Args|Attributes|Returns|Yields|Raises):\n((?:[ ]{4}.*\n?|\n)*)", re.MULTILINE)
DOCUMENTED: Final = re.compile(r"^    \*{0,2}(\w+(?:, \*{0,2}\w+)*)(?: \([^)]*\))?:", re.MULTILINE)


def exports() -> Iterator[tuple[str, Any]]:
    """Yield what packages export, by qualified name."""
    for package in PACKAGES:
        module = importlib.import_module(package)
        source = Path(str(module.__file__)).read_text(encoding="utf-8")
        for node in ast.walk(ast.parse(source)):
            for each in node.names if isinstance(node, ast.ImportFrom) else ():
                if each.asname == each.name:
                    yield f"{package}.{each.name}", getattr(module, each.name)
    for found in pkgutil.walk_packages(importlib.import_module(TOOLS).__path__, f"{TOOLS}."):
        module = importlib.import_module(found.name)
        for key, value in vars(module).items():
            if not key.startswith("_") and getattr(value, "__module__", "") == found.name:
                yield f"{found.name}.{key}", value


def callables() -> dict[str, tuple[Callable[..., Any], str]]:
    """Return functions, constructors and public methods, with the docstrings that have their parameters."""
    found: dict[str, tuple[Callable[..., Any], str]] = {}
    for name, value in exports():
        if inspect.isfunction(value):
            found[name] = value, inspect.getdoc(value) or ""
        elif inspect.isclass(value) and not issubclass(value, Enum | BaseException):
            found.update(_methods(name, value))
    return found


def _methods(name: str, cls: type) -> Iterator[tuple[str, tuple[Callable[..., Any], str]]]:
    # The fields of dataclasses have docstrings of their own, and only the node calls what it makes.
    ready_made = (
        is_dataclass(cls) or "Made by `Node." in (cls.__doc__ or "") or getattr(cls, "_is_protocol", False)
    )
    # Methods of tuples, dicts and protocols from elsewhere are documented there.
    for key in dir(cls):
        if (key.startswith("_") and key != "__init__") or (ready_made and key == "__init__"):
            continue
        owner = next(each for each in cls.__mro__ if key in vars(each))
        if owner.__module__.partition(".")[0] not in {"actors", "broker", "proto"}:
            continue
        member = inspect.getattr_static(cls, key)
        member = member.__func__ if isinstance(member, classmethod | staticmethod) else member
        if inspect.isfunction(member):
            text = inspect.getdoc(cls if key == "__init__" else member) or ""
            yield (name if key == "__init__" else f"{name}.{key}"), (member, text)


def shortcomings(function: Callable[..., Any], text: str) -> list[str]:
    """Return what a docstring does not say of a callable, and what it says of no parameter."""
    sections: dict[str, str] = dict(SECTION.findall(text))
    listed = "\n".join(sections.get(each, "") for each in ("Args", "Attributes"))
    named = {each.strip("* ") for names in DOCUMENTED.findall(listed) for each in names.split(",")}
    parameters = {
        each
        for each in inspect.signature(function).parameters
        if each not in {"self", "cls"} and each[0] != "_"
    }
    wrong = [f"Args: {each} is missing" for each in sorted(parameters - named)]
    args = {
        each.strip("* ")
        for names in DOCUMENTED.findall(sections.get("Args", ""))
        for each in names.split(",")
    }
    wrong += [f"Args: there is no parameter {each}" for each in sorted(args - parameters)]
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


EXPORTED: Final = callables()


@pytest.mark.parametrize("name", sorted(EXPORTED))
def test_an_exported_callable_documents_arguments_and_result(name: str) -> None:
    """Each parameter has a line in Args, or in Attributes of its class, and Args has no other lines."""
    assert not shortcomings(*EXPORTED[name])


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
