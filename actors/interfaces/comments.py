"""Comments of interface types: the docstrings of a class and of its fields.

    class Reading(Message):
        \"\"\"One measurement.\"\"\"

        celsius: float = 0.0
        \"\"\"Temperature of the air [°C].\"\"\"

The interpreter drops the string below a field when it compiles the class, so comments cost neither memory nor
time until somebody asks for them. They are then read from the module's source.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, field
from functools import cache
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    import ast
    from collections.abc import Iterable
    from types import ModuleType

# Those of `specs.PARTS`, whose import would be circular.
_PARTS: Final = ("Request", "Response", "Goal", "Result", "Feedback")


@dataclass(frozen=True)
class Comments:
    """The comments of one type.

    Attributes:
        own: The comment of the type itself; empty without one.
        fields: Comments by the name of a field or constant; without those that have none.
    """

    own: str = ""
    fields: dict[str, str] = field(default_factory=dict[str, str])


def placeholder(name: str) -> str:
    """Return the docstring of a generated class without a comment: of a part ("Request") or a whole type."""
    return f"{name}." if "/" in name else f"The {name.lower()}."


@cache
def comments_of(cls: Any) -> Comments:
    """Return the comments of a message, service or action class.

    They are read from its module's source once. A class without a source, as one made at run time or in an
    interactive session, has none.

    Args:
        cls: The class. Those of a service's or action's fields belong to the classes of its parts.
    """
    own, fields = "", dict[str, str]()
    # From the bases, so that the class's own comments replace theirs.
    for each in reversed(cls.__mro__):
        module = sys.modules.get(each.__module__)
        found = None if module is None else _of_module(module).get(each.__qualname__)
        own = found.own if found else ""
        fields |= found.fields if found else {}
    return Comments("" if own in _placeholders(cls) else own, fields)


def _placeholders(cls: type[Any]) -> set[str]:
    return {placeholder(cls.__name__), placeholder(str(cls.__dict__.get("__ros_type_name__")))}


@cache
def _of_module(module: ModuleType) -> dict[str, Comments]:
    """Return the comments of all classes in a module's source, by their qualified names."""
    import ast  # noqa: PLC0415 - seldom needed

    try:
        tree = ast.parse(_source(module))
    except (
        ImportError,
        OSError,
        SyntaxError,
        ValueError,
    ):  # the file is gone, or another one since the import
        return {}
    found: dict[str, Comments] = {}
    pending: list[tuple[str, ast.AST]] = [("", tree)]
    while pending:
        prefix, node = pending.pop()
        for child in ast.iter_child_nodes(node):
            match child:
                case ast.ClassDef():
                    name = f"{prefix}{child.name}"
                    found[name] = Comments(_text(child.body[0]), dict(_of_fields(child.body)))
                    pending.append((f"{name}.", child))
                case ast.FunctionDef() | ast.AsyncFunctionDef():
                    pending.append((f"{prefix}{child.name}.<locals>.", child))
                case _:
                    pending.append((prefix, child))
    return found


def _source(module: ModuleType) -> str:
    """Return the source of a module; "" if nothing tells where it is."""
    import tokenize  # noqa: PLC0415 - seldom needed

    get_source = getattr(getattr(module, "__loader__", None), "get_source", None)
    if get_source is not None:
        return get_source(module.__name__) or ""
    file = getattr(module, "__file__", None)
    if file is None:
        return ""
    with tokenize.open(file) as stream:
        return stream.read()


def _of_fields(body: list[ast.stmt]) -> Iterable[tuple[str, str]]:
    import ast  # noqa: PLC0415 - seldom needed

    for statement, below in pairwise(body):
        if isinstance(statement, ast.AnnAssign) and isinstance(statement.target, ast.Name):
            text = _text(below)
            if text:
                yield statement.target.id, text


def _text(statement: ast.stmt) -> str:
    """Return the text of a statement that is a docstring; "" for any other."""
    import ast  # noqa: PLC0415 - seldom needed

    match statement:
        case ast.Expr(value=ast.Constant(value=str() as text)):
            first, *rest = text.expandtabs().splitlines() or [""]
            indent = " " * statement.col_offset
            lines = [first, *(line.removeprefix(indent) for line in rest)]
            return "\n".join(line.rstrip() for line in lines).strip()
        case _:
            return ""


def documentation(cls: Any, own: str | None) -> str | None:
    """Return a docstring with the comments of the fields.

    Args:
        cls: The class; of a service or action, the fields of its parts.
        own: Its own docstring.
    """
    lines = _listed("Attributes:", comments_of(cls).fields)
    for part in _PARTS:
        message = cls.__dict__.get(part)
        if isinstance(message, type):
            lines += _listed(f"{part}:", comments_of(message).fields)
    if not lines:
        return own
    own = (own or "").rstrip()
    # As far in as the docstring's own lines, so that `inspect.cleandoc` takes this from all.
    indents = [len(line) - len(line.lstrip()) for line in own.splitlines()[1:] if line.strip()]
    indent = " " * min(indents, default=4)
    return "\n".join([own, *(f"{indent}{line}".rstrip() for line in lines), indent])


def _listed(heading: str, comments: dict[str, str]) -> list[str]:
    if not comments:
        return []
    lines = ["", heading]
    for name, comment in comments.items():
        first, *rest = comment.splitlines()
        lines += [f"    {name}: {first}", *(f"        {line}" for line in rest)]
    return lines
