"""Content filters: expressions in the part of SQL that DDS has for them, as Fast DDS reads it.

An expression becomes a function of a message once, when it is set; nothing of it is evaluated as Python. The
grammar is that of annex B of the DDS specification (OMG, 1.4), without its joins. Where that leaves things
open, this is what ROS 2 Kilted does:

- AND and OR have the same rank and are read from left to right. NOT is for the one condition behind it, but
  everything from a NOT on, to the end or to its closing bracket, is grouped: `a AND NOT b OR c` is
  `a AND ((NOT b) OR c)`.
- Keywords are all upper or all lower case. A letter or digit needs a space before it behind `<>`, `!=`, `<=`
  and `>=`.
- NaN equals every number. Numbers are compared as float32 where one is a literal with a fraction or a
  float32, unless the other is a float64.
- A message without an element that the expression names, such as `position[1]`, is not received.
"""

from __future__ import annotations

import re
from array import array
from dataclasses import dataclass
from operator import attrgetter
from typing import TYPE_CHECKING, Any, Final, NoReturn

from actors.interfaces.fields import fields_of
from actors.ros.rclpy._rclpy_pybind11 import RCLError
from actors.ros.rclpy.subscription_content_filter_options import ContentFilterOptions

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from actors.interfaces.naming import MessageType

    Values = Sequence[Any]
    Condition = Callable[[Values], bool]

MAX_LENGTH: Final = 4096
"""Characters of an expression: every message is compared with all of it, and programs write a line."""
MAX_DEPTH: Final = 32
"""Brackets and NOTs in each other: each takes frames of Python's stack, for every message."""
MAX_PARAMETERS: Final = 100
"""`%0` to `%99`, as the specification has it."""
MAX_STRING_BYTES: Final = 255
"""Bytes of a string in an expression or a parameter, as in Fast DDS."""

MAX_DIGITS: Final = 40
"""Digits of an integer: none of 64 bits has more, and zeros before it are few."""
MAX_INDEX: Final = 2**32
"""Elements of a sequence, which none has."""

_SPACES: Final = r"[ \t\n\v\f\r]*"
_END: Final = r"(?![A-Za-z0-9_])"
_NAME: Final = r"[A-Za-z_][A-Za-z0-9_]*(?:\[[0-9]+\])?"
_FIELD: Final = re.compile(rf"{_NAME}(?:\.{_NAME})*")
_LITERAL: Final = re.compile(
    rf"{_SPACES}(?P<bool>TRUE|true|FALSE|false){_END}{_SPACES}"
    r"|(?P<float>[+-]?[0-9]+(?:[eE][+-]?[0-9]+|\.[0-9]+(?:[eE][+-]?[0-9]+)?))"
    r"|(?P<int>[+-]?(?:0[xX][0-9a-fA-F]+|[0-9]+))"
    r"|[`'](?P<char>(?s:.))'|[`'](?P<string>[^'\r\n]*)'"
)
_PARAMETER: Final = re.compile(r"%([0-9]{1,2})")
_OPERATOR: Final = re.compile(rf"{_SPACES}((?:MATCH|match|LIKE|like|<>|!=|<=|>=){_END}|[<>=]){_SPACES}")
_BETWEEN: Final = re.compile(rf"{_SPACES}(NOT |not )?(?:BETWEEN|between){_END}{_SPACES}")
_AND: Final = re.compile(rf"{_SPACES}(?:AND|and){_END}{_SPACES}")
_AND_OR: Final = re.compile(rf"{_SPACES}(AND|and|OR|or){_END}{_SPACES}")
_NOT: Final = re.compile(rf"{_SPACES}(?:NOT|not){_END}{_SPACES}")
_OPEN: Final = re.compile(rf"\({_SPACES}")
_CLOSE: Final = re.compile(rf"{_SPACES}\)")

_KINDS: Final = {
    "bool": "bool", "float32": "float32", "float64": "float64", "string": "string", "wstring": "string",
}  # fmt: skip
"""The kinds of fields that are no integers."""
_COMPATIBLE: Final = ({"bool", "int"}, {"int", "float", "float32", "float64"}, {"string"})
_WILDCARDS: Final = re.compile(r"[%*]+")
_ANY: Final = r"[^\n\r]"
"""What the other wildcards of LIKE are: `_`, `?` and `.`."""
_REGULAR: Final = frozenset("\\^$+|()[]{}")

# Without Python's `==`, for which NaN is not even equal to itself.
_TESTS: Final[dict[str, Callable[[Any, Any], bool]]] = {
    "=": lambda left, right: not (left < right or left > right),
    "<>": lambda left, right: left < right or left > right,
    "!=": lambda left, right: left < right or left > right,
    "<": lambda left, right: left < right,
    ">": lambda left, right: left > right,
    "<=": lambda left, right: not left > right,
    ">=": lambda left, right: not left < right,
}


class ContentFilter:
    """The content filter of a subscription, whose arguments are as for `compile_filter`.

    Attributes:
        options: What it was made of.
        passes: Whether a message passes.
    """

    def __init__(self, expression: str, parameters: Sequence[str], message_class: MessageType) -> None:
        given: tuple[Any, ...] = (parameters, expression, *parameters)  # of an unchecked program
        if isinstance(given[0], str) or not all(isinstance(each, str) for each in given[1:]):
            raise TypeError("A content filter is a string, its expression, and a list of strings")
        self.options = ContentFilterOptions(expression, list(parameters))
        self.passes = compile_filter(expression, parameters, message_class)


def compile_filter(
    expression: str, parameters: Sequence[str], message_class: MessageType
) -> Callable[[Any], bool]:
    """Return a function that says whether a message passes the filter.

    Args:
        expression: Such as "pose.position.x > %0 AND header.frame_id = 'map'"; all messages pass "".
        parameters: The values of `%0`, `%1`, ..., as literals: strings are in quotes.
        message_class: The class of the messages.

    Raises:
        RCLError: The expression or a parameter is wrong or beyond a limit; the text says where.
    """
    if len(expression) > MAX_LENGTH:
        raise RCLError(f"The filter expression has {len(expression)} characters; the limit is {MAX_LENGTH}")
    if len(parameters) > MAX_PARAMETERS:
        raise RCLError(f"The filter has {len(parameters)} parameters; at most {MAX_PARAMETERS} are possible")
    if not expression:
        return lambda _message: True
    parser = _Parser(expression, parameters, message_class)
    condition = parser.parse()
    readers = tuple(parser.readers.values())

    def passes(message: Any) -> bool:
        # All of them before anything is compared, as in Fast DDS: one that is not there decides.
        try:
            values = [read(message) for read in readers]
        except IndexError:
            return False
        return condition(values)

    return passes


@dataclass(frozen=True)
class _Operand:
    """One side of a comparison.

    Attributes:
        kind: "bool", "int", "float" (a literal), "float32", "float64" or "string".
        value: The literal, or the field's place among the values.
        is_field: Which of the two it is.
    """

    kind: str
    value: Any
    is_field: bool = False

    def of(self, other: _Operand) -> Callable[[Values], Any]:
        """Return a function for its value, as it is compared with another operand."""
        convert = _conversion(self.kind, other.kind)
        place = value = self.value
        if not self.is_field:
            value = value if convert is None else convert(value)
            return lambda _values: value
        if convert is None:
            return lambda values: values[place]
        return lambda values: convert(values[place])


def _conversion(kind: str, other: str) -> Callable[[Any], Any] | None:
    """Return how a number of a kind is rounded where it is compared with one of another kind."""
    kinds = {kind, other}
    if "float64" in kinds:
        return float
    return _single if kinds & {"float", "float32"} else None


def _single(number: float) -> float:
    return array("f", [number])[0]


class _Parser:
    """Reads an expression from left to right.

    Attributes:
        readers: Gets the value of each field that the expression names from a message.
    """

    def __init__(self, text: str, parameters: Sequence[str], message_class: MessageType) -> None:
        self.readers: dict[str, Callable[[Any], Any]] = {}
        self._kinds: dict[str, str] = {}
        self._text = text
        self._at = 0
        self._depth = 0
        self._parameters = parameters
        self._class = message_class

    def parse(self) -> Condition:
        """Return the condition of the whole expression."""
        condition = self._list()
        if self._at < len(self._text):
            self._fail("expected AND, OR or the end")
        return condition

    def _fail(self, problem: str) -> NoReturn:
        where = self._text[self._at : self._at + 20] or "its end"
        raise RCLError(f"Filter expression {self._text!r}, at {where!r}: {problem}")

    def _next(self, pattern: re.Pattern[str]) -> re.Match[str] | None:
        match = pattern.match(self._text, self._at)
        if match is not None:
            self._at = match.end()
        return match

    def _list(self, *, negated: bool = False) -> Condition:
        """Read conditions with AND and OR between them; `negated` is for the first one."""
        self._depth += 1
        if self._depth > MAX_DEPTH:
            self._fail(f"more than {MAX_DEPTH} brackets and NOTs in each other")
        first = self._condition()
        if negated:
            first = _negation(first)
        others: list[tuple[bool, Condition]] = []
        while operator := self._next(_AND_OR):
            others.append((operator[1] in {"AND", "and"}, self._condition()))
        self._depth -= 1
        return _combination(first, others) if others else first

    def _condition(self) -> Condition:
        if self._next(_OPEN):
            inner = self._list()
            if not self._next(_CLOSE):
                self._fail("expected AND, OR or a closing bracket")
            return inner
        if self._next(_NOT):
            return self._list(negated=True)
        left = self._operand()
        if left.is_field and (between := self._next(_BETWEEN)):
            return self._between(left, negated=between[1] is not None)
        operator = self._next(_OPERATOR)
        if operator is None:
            self._fail("expected an operator: =, <>, !=, <, >, <=, >=, LIKE or BETWEEN")
        right = self._operand()
        if not left.is_field and not right.is_field:
            self._fail("a comparison needs a field of the message")
        self._require_compatible(left, right)
        name = operator[1].upper()
        if name == "MATCH":
            self._fail("callboard has no MATCH, as regular expressions can take for ever: use LIKE")
        if name == "LIKE":
            return self._like(left, right)
        test, of_left, of_right = _TESTS[name], left.of(right), right.of(left)
        return lambda values: test(of_left(values), of_right(values))

    def _between(self, field: _Operand, *, negated: bool) -> Condition:
        low = self._operand()
        if not self._next(_AND):
            self._fail("expected AND and the upper bound")
        high = self._operand()
        if low.is_field or high.is_field:
            self._fail("the bounds of BETWEEN are literals or parameters")
        self._require_compatible(field, low)
        self._require_compatible(field, high)
        of_low, least = field.of(low), low.of(field)(())
        of_high, most = field.of(high), high.of(field)(())
        return lambda values: (not (of_low(values) < least or of_high(values) > most)) is not negated

    def _like(self, left: _Operand, right: _Operand) -> Condition:
        if left.kind != "string" or not left.is_field or right.is_field:
            self._fail("LIKE compares a field that is a string with a pattern")
        matches, place = self._pattern(right.value).fullmatch, left.value
        return lambda values: matches(values[place]) is not None

    def _pattern(self, like: str) -> re.Pattern[str]:
        """Return a regular expression for a pattern of LIKE, without parts that try again and again."""
        if bad := _REGULAR.intersection(like):
            self._fail(f"{min(bad)!r} in a pattern of LIKE is part of a regular expression for ROS 2")
        parts = [
            "".join(_ANY if each in "_?." else re.escape(each) for each in part)
            for part in _WILDCARDS.split(like)
        ]
        if len(parts) == 1:
            return re.compile(parts[0])
        # A part between two wildcards is where it is found first: to look further would change nothing.
        middle = "".join(f"(?>{_ANY}*?{part})" for part in parts[1:-1])
        return re.compile(f"{parts[0]}{middle}{_ANY}*{parts[-1]}")

    def _require_compatible(self, left: _Operand, right: _Operand) -> None:
        if not any({left.kind, right.kind} <= kinds for kinds in _COMPATIBLE):
            self._fail(f"a {left.kind} cannot be compared with a {right.kind} (strings are in single quotes)")

    def _operand(self) -> _Operand:
        if literal := self._next(_LITERAL):
            return self._literal(literal)
        if parameter := self._next(_PARAMETER):
            return self._parameter(int(parameter[1]))
        field = self._next(_FIELD)
        if field is None:
            self._fail("expected a field, a literal or a parameter such as %0")
        return self._field(field[0])

    def _literal(self, literal: re.Match[str]) -> _Operand:
        text = literal[literal.lastgroup or 0]
        if literal["bool"]:
            return _Operand("bool", text in {"TRUE", "true"})
        if literal["float"]:
            return _Operand("float", float(text))
        if literal["int"]:
            return _Operand("int", self._integer(text))
        if len(text.encode()) > MAX_STRING_BYTES:
            self._fail(f"a string of the filter has more than {MAX_STRING_BYTES} bytes")
        return _Operand("string", text)

    def _integer(self, text: str) -> int:
        digits = text.lstrip("+-").lower()
        if len(digits) > 1 and digits[0] == "0" and digits[1] != "x":
            base = 8
            if "8" in digits or "9" in digits:
                self._fail(f"{text} begins with 0, which makes it an octal number")
        else:
            base = 16 if digits[1:2] == "x" else 10
        # The limit on digits is Python's own for what follows.
        number = int(text, base) if len(digits) <= MAX_DIGITS else 2**64
        if not -(2**63) <= number < 2**64:
            self._fail(f"{text} does not fit into 64 bits")
        return number

    def _parameter(self, index: int) -> _Operand:
        if index >= len(self._parameters):
            self._fail(f"there is no parameter %{index}, only {len(self._parameters)}")
        text = self._parameters[index]
        literal = _LITERAL.fullmatch(text)
        if literal is None:
            self._fail(f"parameter %{index} is no literal (strings are in single quotes): {text[:80]!r}")
        return self._literal(literal)

    def _field(self, text: str) -> _Operand:
        """Return the field of a path such as `points[0].x`."""
        if text not in self.readers:
            self._kinds[text], self.readers[text] = self._reader(text)
        place = list(self.readers).index(text)
        return _Operand(self._kinds[text], place, is_field=True)

    def _reader(self, path: str) -> tuple[str, Callable[[Any], Any]]:
        """Return a field's kind, and a function that gets its value from a message."""
        message_class: MessageType | None = self._class
        steps: list[tuple[str, int | None]] = []
        base = ""
        for part in path.split("."):
            name, _, rest = part.rstrip("]").partition("[")
            fields = () if message_class is None else fields_of(message_class)
            field = next((each.type for each in fields if each.name == name), None)
            if field is None:
                self._fail(f"the messages have no field {path!r}: {name!r} is not there")
            if field.is_array is not bool(rest):
                self._fail(f"{name!r} in {path!r} " + ("needs an index" if field.is_array else "is no array"))
            index = int(rest[:MAX_DIGITS]) if rest else None
            if index is not None and index >= (MAX_INDEX if field.high is None else field.high):
                self._fail(f"index {rest} of {name!r} is beyond its size")
            steps.append((name, index))
            message_class, base = field.message, field.base
        if message_class is not None:
            self._fail(f"{path!r} is a message: name one of its fields")
        get = _getter(steps)
        return _KINDS.get(base, "int"), _number_of(get) if base == "byte" else get


def _getter(steps: list[tuple[str, int | None]]) -> Callable[[Any], Any]:
    """Return a function that follows a path."""
    if all(index is None for _, index in steps):
        return attrgetter(".".join(name for name, _ in steps))

    def get(message: Any) -> Any:
        for name, index in steps:
            message = getattr(message, name)
            if index is not None:
                message = message[index]
        return message

    return get


def _number_of(get: Callable[[Any], Any]) -> Callable[[Any], int]:
    """Return a function that gives a byte as a number: messages may have it as `bytes`."""

    def number(message: Any) -> int:
        value = get(message)
        return value if isinstance(value, int) else value[0]

    return number


def _negation(condition: Condition) -> Condition:
    return lambda values: not condition(values)


def _combination(first: Condition, others: list[tuple[bool, Condition]]) -> Condition:
    """Return conditions with AND (True) or OR between them, from left to right."""

    def holds(values: Values) -> bool:
        result = first(values)
        for is_and, condition in others:
            if result is is_and:  # otherwise the condition changes nothing
                result = condition(values)
        return result

    return holds
