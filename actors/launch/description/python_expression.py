"""Python expressions: a small part of the language, evaluated here, with limits on size and time.

    PythonExpression(["'", LaunchConfiguration("robot"), "' == 'r2' or ", LaunchConfiguration("n"), " > 2"])

Python only parses the expression. It cannot reach names, attributes, files or other code: everything that is
not in the tables below is an error, and so are long evaluations and large values. Launch arguments become
part of expressions, so these must be harmless whatever the arguments are.
"""

from __future__ import annotations

import ast
import operator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final, cast

from actors.launch.description.options import required
from actors.launch.description.substitutions import Substitution, resolve
from actors.launch.errors import LaunchError
from proto.untrusted_text import escape

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from actors.launch.description.substitutions import LaunchContext, Text

MAX_EXPRESSION_CHARS: Final = 4096
MAX_PARTS: Final = 500
"""Values and operators of an expression."""
MAX_NESTING: Final = 60
"""Depth of nested parts."""
MAX_INT_BITS: Final = 256
MAX_LENGTH: Final = 1 << 14
"""Length of each string and list during evaluation, and of the result as a string."""
MAX_DIGITS: Final = 100
"""Digits that `round` accepts."""


@dataclass(frozen=True)
class PythonExpression(Substitution):
    """The value of a Python expression as a string, such as "True", "3" or "1.5".

    It may consist of numbers, strings, True, False, None, lists, tuples, dictionaries, indexes and slices, of
    `and`, `or`, `not`, `if … else`, comparisons, `in`, `+ - * / // % **`, and of the `FUNCTIONS` and
    the `METHODS` of strings below.
    """

    expression: Text = field(
        metadata=required(
            'The expression. A string in it needs quotes: ["\'", LaunchConfiguration("robot"), "\'"].'
        )
    )

    def perform(self, context: LaunchContext) -> str:
        expression = resolve(self.expression, context)
        text = str(evaluate(expression))
        if len(text) > MAX_LENGTH:
            raise _error(expression, _TOO_LONG)
        return text


def evaluate(expression: str) -> Any:
    """Return the value of an expression.

    Raises:
        LaunchError: It is not supported, cannot be evaluated, or exceeds a limit.
    """
    try:
        return _value(_parsed(expression))
    except KeyError as error:
        raise _error(expression, f"there is no {error}") from None
    except OverflowError:  # its own text depends on the platform
        raise _error(expression, "a number becomes too large") from None
    except (ValueError, TypeError, ArithmeticError, IndexError) as error:
        raise _error(expression, str(error)) from None


_TOO_LONG: Final = f"it becomes longer than {MAX_LENGTH} characters or values"
_TOO_LARGE: Final = f"a number becomes larger than {MAX_INT_BITS} bits"
_SHOWN_CHARS: Final = 100


def _error(expression: str, reason: str) -> LaunchError:
    return LaunchError(f"Expression {_quoted(expression)}: {escape(reason)}")


def _quoted(text: str) -> str:
    return f"'{escape(text[:_SHOWN_CHARS])}{'…' if len(text) > _SHOWN_CHARS else ''}'"


def _parsed(expression: str) -> ast.expr:
    """Return the expression as a tree that is small enough to be walked."""
    if len(expression) > MAX_EXPRESSION_CHARS:
        raise ValueError(f"it is longer than {MAX_EXPRESSION_CHARS} characters")
    try:
        top = ast.parse(expression.strip(), mode="eval").body
    except SyntaxError as error:
        raise ValueError(error.msg) from None
    except (RecursionError, MemoryError):  # the parser raises either
        raise ValueError("it is nested too deeply") from None
    level: list[ast.AST] = [top]
    parts = depth = 0
    while level:
        parts += len(level)
        depth += 1
        if parts > MAX_PARTS or depth > MAX_NESTING:
            raise ValueError(
                f"it has more than {MAX_PARTS} parts, or more than {MAX_NESTING} within each other"
            )
        level = [
            inner
            for node in level
            for inner in ast.iter_child_nodes(node)
            if not isinstance(inner, _NO_PARTS)
        ]
    return top


_NO_PARTS: Final = (ast.expr_context, ast.operator, ast.unaryop, ast.boolop, ast.cmpop)


def _value(node: ast.expr) -> Any:
    rule = _RULES.get(type(node))
    if rule is None:
        raise ValueError(f"{_quoted(ast.unparse(node))} cannot be used here")
    return _bounded(rule(node))


def _bounded(value: Any) -> Any:
    match value:
        case int() if value.bit_length() > MAX_INT_BITS:
            raise ValueError(_TOO_LARGE)
        case str() | list() | tuple() | dict() if len(cast("Sequence[Any]", value)) > MAX_LENGTH:
            raise ValueError(_TOO_LONG)
        case complex():
            raise ValueError("it becomes a complex number")
        case _:
            return value


# Operators. Python's own could make much out of little: 9**9**9, 'a'*10**9, '%99999999d'%1.


def _on_numbers(operation: Callable[[Any, Any], Any]) -> Callable[[Any, Any], Any]:
    def checked(left: Any, right: Any) -> Any:
        for each in (left, right):
            if not isinstance(each, int | float):
                raise TypeError(f"{_quoted(repr(each))} is not a number")
        return operation(left, right)

    return checked


def _times(left: Any, right: Any) -> Any:
    text, count = (right, left) if isinstance(right, str) else (left, right)
    if not isinstance(text, str):
        return _on_numbers(operator.mul)(left, right)
    if isinstance(count, int) and len(text) * count > MAX_LENGTH:
        raise ValueError(_TOO_LONG)
    return text * count


def _power(base: Any, exponent: Any) -> Any:
    whole = isinstance(base, int) and isinstance(exponent, int)
    # One bit less than each factor has: the result has at least that many.
    if whole and abs(base) > 1 and (base.bit_length() - 1) * exponent > MAX_INT_BITS:
        raise ValueError(_TOO_LARGE)
    return base**exponent


_BINARY: Final[dict[type[ast.operator], Callable[[Any, Any], Any]]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: _times,
    ast.Div: _on_numbers(lambda left, right: left / right),
    ast.FloorDiv: _on_numbers(lambda left, right: left // right),
    ast.Mod: _on_numbers(operator.mod),
    ast.Pow: _on_numbers(_power),
}
_UNARY: Final[dict[type[ast.unaryop], Callable[[Any], Any]]] = {
    ast.Not: operator.not_,
    ast.USub: operator.neg,
    ast.UAdd: operator.pos,
}
_COMPARISONS: Final[dict[type[ast.cmpop], Callable[[Any, Any], Any]]] = {
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
    ast.In: lambda left, right: left in right,
    ast.NotIn: lambda left, right: left not in right,
}


def _binary(node: ast.BinOp) -> Any:
    return _known(_BINARY, node.op, node)(_value(node.left), _value(node.right))


def _unary(node: ast.UnaryOp) -> Any:
    return _known(_UNARY, node.op, node)(_value(node.operand))


def _bool(node: ast.BoolOp) -> Any:
    value: Any = None
    for each in node.values:
        value = _value(each)
        if bool(value) is isinstance(node.op, ast.Or):
            break
    return value


def _compare(node: ast.Compare) -> bool:
    left = _value(node.left)
    for operation, each in zip(node.ops, node.comparators, strict=True):
        right = _value(each)
        if not _known(_COMPARISONS, operation, node)(left, right):
            return False
        left = right
    return True


def _known(table: Mapping[Any, Callable[..., Any]], operation: ast.AST, node: ast.expr) -> Callable[..., Any]:
    found = table.get(type(operation))
    if found is None:
        raise ValueError(f"{_quoted(ast.unparse(node))} has an operator that cannot be used here")
    return found


def _round(number: Any, digits: int | None = None) -> Any:
    if isinstance(digits, int) and abs(digits) > MAX_DIGITS:
        raise ValueError(f"round() takes {MAX_DIGITS} digits at most")
    return round(number, digits)


def _replace(text: str, old: str, new: str, count: int = -1) -> str:
    if len(text) + text.count(old) * (len(new) - len(old)) > MAX_LENGTH:
        raise ValueError(_TOO_LONG)
    return text.replace(old, new, count)


FUNCTIONS: Final[dict[str, Callable[..., Any]]] = {
    "int": int,
    "float": float,
    "str": str,
    "bool": bool,
    "len": len,
    "abs": abs,
    "min": min,
    "max": max,
    "round": _round,
}
METHODS: Final[dict[str, Callable[..., Any]]] = {
    "lower": str.lower,
    "upper": str.upper,
    "strip": str.strip,
    "startswith": str.startswith,
    "endswith": str.endswith,
    "replace": _replace,
    "split": str.split,
}


def _call(node: ast.Call) -> Any:
    match node:
        case ast.Call(func=ast.Name(id=name), args=args, keywords=[]) if name in FUNCTIONS:
            return FUNCTIONS[name](*map(_value, args))
        case ast.Call(func=ast.Attribute(value=value, attr=name), args=args, keywords=[]) if name in METHODS:
            text = _value(value)
            if not isinstance(text, str):
                raise TypeError(f"{name}() needs a string, not {_quoted(repr(text))}")
            return METHODS[name](text, *map(_value, args))
        case _:
            raise ValueError(f"{_quoted(ast.unparse(node))} cannot be called here")


def _constant(node: ast.Constant) -> Any:
    if node.value is not None and not isinstance(node.value, bool | int | float | str):
        raise ValueError(f"{_quoted(ast.unparse(node))} cannot be used here")
    return node.value


def _name(node: ast.Name) -> Any:
    raise ValueError(f"'{node.id}' is not known: strings need quotes, and truth values are True and False")


def _dict(node: ast.Dict) -> dict[Any, Any]:
    if None in node.keys:
        raise ValueError("'**' cannot be used here")
    keys = cast("Sequence[ast.expr]", node.keys)
    return {_value(key): _value(value) for key, value in zip(keys, node.values, strict=True)}


def _slice(node: ast.Slice) -> slice:
    return slice(*(None if each is None else _value(each) for each in (node.lower, node.upper, node.step)))


_RULES: Final[dict[type[ast.expr], Callable[[Any], Any]]] = {
    ast.Constant: _constant,
    ast.Name: _name,
    ast.List: lambda node: [_value(each) for each in node.elts],
    ast.Tuple: lambda node: tuple(_value(each) for each in node.elts),
    ast.Dict: _dict,
    ast.Subscript: lambda node: _value(node.value)[_value(node.slice)],
    ast.Slice: _slice,
    ast.BinOp: _binary,
    ast.UnaryOp: _unary,
    ast.BoolOp: _bool,
    ast.Compare: _compare,
    ast.IfExp: lambda node: _value(node.body if _value(node.test) else node.orelse),
    ast.Call: _call,
}
