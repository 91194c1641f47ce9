"""Expressions: what they come to, and that no text does harm."""

from __future__ import annotations

import sys
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from actors.launch.description.python_expression import (
    FUNCTIONS,
    MAX_EXPRESSION_CHARS,
    MAX_INT_BITS,
    MAX_LENGTH,
    METHODS,
    PythonExpression,
    evaluate,
)
from actors.launch.description.substitutions import LaunchConfiguration, resolve
from actors.launch.errors import LaunchError
from tests.actors.launch.fake_library import scope


@pytest.mark.parametrize(
    ("expression", "value"),
    [
        ("1", 1),
        (" -1.5 ", -1.5),
        ("'a' \"b\"", "ab"),
        ("None", None),
        ("[1, 'a', (True,), {}]", [1, "a", (True,), {}]),
        ("{'a': [1, 2]}['a'][1]", 2),
        ("'hello'[1:4], 'hello'[::-1], [1, 2][:1]", ("ell", "olleh", [1])),
        ("1 + 2 * 3 - 4 / 2 ** 2 // 1 % 5", 6.0),
        ("-(1), +2, not 3", (-1, 2, False)),
        ("'a' + 'b' * 2 + 2 * 'c'", "abbcc"),
        ("[1] + [2], (1,) + ()", ([1, 2], (1,))),
        ("1 < 2 <= 2 != 3 == 3 >= 1 > 0", True),
        ("1 < 3 < 2", False),
        ("'a' in 'cat' and 'x' not in ['a']", True),
        ("0 or '' or 'last'", "last"),
        ("1 and 0 and missing", 0),
        ("1 or missing", 1),
        ("3 > missing if False else 'no'", "no"),
        ("int('3') + int('ff', 16) + float('0.5')", 258.5),
        ("str(1.0), bool('')", ("1.0", False)),
        ("len('abc'), abs(-1), min(2, 1), max([1, 3])", (3, 1, 1, 3)),
        ("round(2.567, 1), round(2.5)", (2.6, 2)),
        ("' A '.strip().lower().upper()", "A"),
        ("'a,b'.split(','), 'a b'.split()", (["a", "b"], ["a", "b"])),
        ("'abc'.startswith('ab') and 'abc'.endswith('bc')", True),
        ("'aaa'.replace('a', 'b', 2), 'ab'.replace('', '-')", ("bba", "-a-b-")),
        ("2 ** 255", 2**255),
        ("(-2) ** 255", (-2) ** 255),
        ("2 ** -1, 0 ** 0, 1 ** 99999999", (0.5, 1, 1)),
        ("1e400", float("inf")),
        ("(" * 150 + "1" + ")" * 150, 1),
    ],
)
def test_expressions_mean_what_they_mean_in_python(expression: str, value: Any) -> None:
    """As far as there are any: parts that are not reached need not be known."""
    got = evaluate(expression)
    assert (got, type(got)) == (value, type(value))


NUMBERS = st.integers(-9, 9) | st.floats(-9, 9, allow_nan=False).map(lambda number: round(number, 2))
TERMS = st.recursive(
    NUMBERS.map(str),
    lambda inner: st.tuples(
        inner, st.sampled_from(["+", "-", "*", "/", "//", "%", "<", "==", "and", "or"]), inner
    ).map(lambda parts: f"({' '.join(parts)})"),
    max_leaves=8,
)


@given(TERMS)
def test_numbers_are_counted_as_python_does(term: str) -> None:
    """Also where that is an error."""
    try:
        expected = eval(term)
    except ZeroDivisionError as error:
        with pytest.raises(LaunchError, match=str(error)):
            evaluate(term)
    else:
        assert repr(evaluate(term)) == repr(expected)


@pytest.mark.parametrize(
    ("expression", "reason"),
    [
        ("robot == 'r2'", "'robot' is not known: strings need quotes, and truth values are True and False"),
        ("__import__('os').system('true')", "cannot be called here"),
        ("open('/etc/passwd')", "'open('/etc/passwd')' cannot be called here"),
        ("().__class__.__base__.__subclasses__()", "cannot be called here"),
        ("'a'.__class__", "''a'.__class__' cannot be used here"),
        ("'{0.__class__}'.format(1)", "cannot be called here"),
        ("'a'.strip", "cannot be used here"),
        ("len", "'len' is not known"),
        ("(1).lower()", "lower() needs a string, not '1'"),
        ("str.lower('A')", "'str' is not known"),
        ("min(1, 2, key=len)", "cannot be called here"),
        ("max(*[1, 2])", "'*[1, 2]' cannot be used here"),
        ("{**{}}", "'**' cannot be used here"),
        ("lambda: 1", "cannot be used here"),
        ("[each for each in 'abc']", "cannot be used here"),
        ("(a := 1)", "cannot be used here"),
        ("f'{1}'", "cannot be used here"),
        ("{1, 2}", "cannot be used here"),
        ("1j", "cannot be used here"),
        ("b'a'", "cannot be used here"),
        ("...", "cannot be used here"),
        ("~1", "'~1' has an operator that cannot be used here"),
        ("1 << 99999999999", "has an operator that cannot be used here"),
        ("1 is 1", "has an operator that cannot be used here"),
        ("'%999999999d' % 1", "is not a number"),
        ("[1] * 999999999", "'[1]' is not a number"),
        ("(-1) ** 0.5", "it becomes a complex number"),
        ("1 / 0", "division by zero"),
        ("2.0 ** 9999", "a number becomes too large"),
        ("[1][1]", "list index out of range"),
        ("{'a': 1}['b']", "there is no 'b'"),
        ("{[]: 1}", "unhashable type: 'list'"),
        ("1 + 'a'", "unsupported operand type(s) for +: 'int' and 'str'"),
        ("int('three')", "invalid literal for int() with base 10: 'three'"),
        ("", "invalid syntax"),
        ("1; 2", "invalid syntax"),
        ("import os", "invalid syntax"),
        ("'\x1b[1m", r"unterminated string literal (detected at line 1)"),
    ],
)
def test_what_is_no_such_expression_is_an_error(expression: str, reason: str) -> None:
    """The reason says what is wrong with it, in one line that is harmless."""
    with pytest.raises(LaunchError) as caught:
        evaluate(expression)
    assert reason in str(caught.value)
    assert str(caught.value).isprintable()


@pytest.mark.parametrize(
    "expression",
    [
        "9 ** 9 ** 9",
        "(-9) ** (9 ** 9)",
        "2 ** 256",
        "(2 ** 255) * 2",
        "1" * 100,
        "int('f' * 10000, 16)",
        "int(1e300)",
        "'a' * 10 ** 9",
        "10 ** 9 * 'a'",
        "('a' * 10000) + ('a' * 10000)",
        "('a' * 10000).replace('a', 'b' * 10000)",
        "('a' * 16384).replace('', 'b')",
        "('ß' * 16384).upper()",
        "('a ' * 8000).split() + ('a ' * 8000).split() + ('a ' * 8000).split()",
        "round(1, -10 ** 9)",
        "round(1, 10 ** 9)",
        "-" * 3000 + "1",
        "(" * 2000 + "1" + ")" * 2000,
        "[" * 61 + "]" * 61,
        "1 + " * 61 + "1",
        "[" + "1, " * 500 + "]",
        "1" + " " * MAX_EXPRESSION_CHARS,
        "\0",
    ],
)
def test_little_cannot_become_much(expression: str) -> None:
    """Sizes are checked before the work is done."""
    with pytest.raises(LaunchError) as caught:
        evaluate(expression)
    assert len(str(caught.value)) < 400


WORDS = [
    *FUNCTIONS,
    *(f".{each}" for each in METHODS),
    *(
        "'",
        "'a'",
        "''",
        "1",
        "99",
        "1e9",
        "True",
        "None",
        "robot",
        ".__class__",
        "__import__",
        " ",
        "\n",
        "\0",
        "é",
    ),
    *(
        "(",
        ")",
        "[",
        "]",
        "{",
        "}",
        ",",
        ":",
        ":=",
        "=",
        ".",
        "*",
        "**",
        "//",
        "%",
        "+",
        "-",
        "<",
        "==",
        "~",
        "@",
    ),
    *(" in ", " not ", " and ", " or ", " if ", " else ", " is ", " for ", "lambda:", "f'{", "b'", "#", "\\"),
]


@pytest.mark.filterwarnings("ignore::SyntaxWarning", "ignore::DeprecationWarning")
@given(st.lists(st.sampled_from(WORDS), max_size=30).map("".join) | st.text(max_size=30))
def test_any_text_gives_a_value_or_an_error(expression: str) -> None:
    """A value is of a kind that is known, and small."""
    try:
        value = evaluate(expression)
    except LaunchError:
        return
    assert isinstance(value, str | int | float | list | tuple | dict | None)
    if isinstance(value, int):
        assert value.bit_length() <= MAX_INT_BITS


PLAIN = st.characters(exclude_categories=["C", "Z"], exclude_characters="'\\")


@given(st.text(PLAIN | st.just(" "), max_size=20))
def test_an_argument_in_quotes_stays_a_text(argument: str) -> None:
    """As long as it has no quotes, line ends or backslashes itself."""
    here = scope(launch_configurations={"robot": argument})
    assert resolve(PythonExpression(["'", LaunchConfiguration("robot"), "'"]), here) == argument


def test_values_become_texts() -> None:
    """In Python's words, which conditions understand."""
    here = scope(launch_configurations={"robot": "r2", "count": "3"})
    equal = PythonExpression(
        ["'", LaunchConfiguration("robot"), "' == 'r2' and ", LaunchConfiguration("count"), " > 2"]
    )
    assert resolve(equal, here) == "True"
    assert resolve(PythonExpression(expression="[1.0, 'a', None]"), here) == "[1.0, 'a', None]"


def test_the_text_has_a_limit_too() -> None:
    """Values that are small enough may be much together."""
    long = f"'a' * {MAX_LENGTH}"
    assert len(resolve(PythonExpression(long), scope())) == MAX_LENGTH
    with pytest.raises(LaunchError, match="it becomes longer than"):
        resolve(PythonExpression(f"[{long}, {long}]"), scope())


def test_there_is_room_on_the_stack_for_the_deepest_expression() -> None:
    """A launch file that is included by others may have it."""
    depth = sys.getrecursionlimit() // 2

    def deep(left: int) -> Any:
        return deep(left - 1) if left else evaluate("[" * 60 + "]" * 60)

    assert isinstance(deep(depth), list)
