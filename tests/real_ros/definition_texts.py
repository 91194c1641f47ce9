"""Strategies for the lines of interfaces: half of them are right, the others are wrong in one detail."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hypothesis import strategies as st

from actors.interfaces.literals import INTEGER_RANGE
from actors.interfaces.parser import PRIMITIVES

if TYPE_CHECKING:
    from hypothesis.strategies import SearchStrategy

SPACES = st.sampled_from([" ", "  ", "\t", " \t "])
PRIMITIVE = st.sampled_from(sorted(PRIMITIVES))
MESSAGES = st.sampled_from(["Pose", "other_msgs/Pose", "Pose2D", "a1_b/P"])
BOUNDED = st.sampled_from(["string<=3", "wstring<=1"])
ARRAYS = st.sampled_from(["[]", "[2]", "[<=2]", "[1]", "[<=10]", "[02]"])
FIELDS = st.sampled_from(["a", "b2", "a_b", "x_1", "names", "a1b2", "value"])
CONSTANTS = st.sampled_from(["A", "B2", "A_B", "X_1", "A1B2", "VALUE"])

WRONG_TYPES = st.sampled_from(
    [
        *(
            "string<=0",
            "string<3",
            "string<=",
            "string<=-1",
            "string<= 3",
            "int32<=3",
            "Pose<=3",
            "int",
            "double",
        ),
        *(
            "pose",
            "Po_se",
            "Other_msgs/Pose",
            "other__msgs/Pose",
            "a/b/Pose",
            "/Pose",
            "é",
            "char*",
            "uint8 []",
        ),
        *(
            "int32[0]",
            "int32[<=0]",
            "int32[-1]",
            "int32[<2]",
            "int32[x]",
            "int32[1.5]",
            "int32[2][2]",
            "int32]",
        ),
        "int32[",
    ]
)
WRONG_NAMES = st.sampled_from(
    ["a__b", "a_", "_a", "2a", "aB", "a-b", "é", "A__B", "A_", "_A", "2A", "Ab", "A-B", "a.b"]
)
WRONG_VALUES = st.sampled_from(
    ["", "yes", "1.5", "abc", 'a"', "a'b", "[1]", "- 1", "1,2", "1 2", "0x", "1e400", "0x_1"]
)


def integers(base: str) -> SearchStrategy[str]:
    """Return texts of integers of a type and just beyond its limits, in several notations."""
    low, high = INTEGER_RANGE[base]
    numbers = st.sampled_from([low, 0, 1, 7, 10, high, low - 1, high + 1])
    notations = st.sampled_from(["{}", "{}", "{:#x}", "{:#o}", "{:#b}", "{:+}", "{:#X}", "{:_}", "{:03}"])
    return st.builds(lambda number, notation: notation.format(number), numbers, notations)


def scalars(base: str) -> SearchStrategy[str]:
    """Return texts of values of a type."""
    if base in INTEGER_RANGE:
        return integers(base)
    if base == "bool":
        return st.sampled_from(["true", "True", "TRUE", "false", "1", "0"])
    if base in {"float32", "float64"}:
        return st.sampled_from(
            ["1", "1.5", "-1e3", ".5", "5.", "inf", "-nan", "1_0.5", "08", "+1", "infinity", "-0"]
        )
    return st.sampled_from(
        [
            "a",
            "'a'",
            '"a"',
            "''",
            '""',
            "' a '",
            "é",
            "1",
            "a'b",
            '"a\'b"',
            "'a\\'b'",
            '"a\\"b"',
            '"a',
            "'a,b'",
            "a b",
            r"a\tb",
            r"'\\a'",
            r"\x41",
        ]
    )


@st.composite
def values(draw: st.DrawFn, base: str, *, is_array: bool) -> str:
    """Return the text of a value of a type."""
    if not is_array:
        return draw(scalars(base))
    separator = draw(st.sampled_from([", ", ",", " , "]))
    items = separator.join(draw(st.lists(scalars(base), max_size=3)))
    return draw(st.sampled_from(["[{}]", "[{}]", "{}", "[{}"])).format(items)


@st.composite
def lines(draw: st.DrawFn) -> str:
    """Return a line of an interface."""
    wrong = draw(st.sampled_from(["nothing", "nothing", "nothing", "type", "name", "value"]))
    comment = draw(st.sampled_from(["", "", " # why", "# why", "#"]))
    base, array, value = draw(PRIMITIVE), "", ""
    is_constant = draw(st.booleans())
    if wrong == "value" or draw(st.booleans()):
        array = "" if is_constant else draw(st.just("") | ARRAYS)
        value = draw(WRONG_VALUES if wrong == "value" else values(base, is_array=bool(array)))
    elif not is_constant:
        base = draw(PRIMITIVE | MESSAGES | BOUNDED)
        array = draw(st.just("") | ARRAYS)
    kind = draw(WRONG_TYPES) if wrong == "type" else base + array
    name = draw(WRONG_NAMES if wrong == "name" else CONSTANTS if is_constant else FIELDS)
    if is_constant:
        return f"{kind}{draw(SPACES)}{name}{draw(st.sampled_from(['=', ' = ', '= ', ' =']))}{value}{comment}"
    return f"{kind}{draw(SPACES)}{name}{draw(SPACES) if value else ''}{value}{comment}"


STANDARD = ("std_msgs/Header", "geometry_msgs/PoseStamped", "builtin_interfaces/Time", "sensor_msgs/Imu")


@st.composite
def parts(draw: st.DrawFn, own: tuple[str, ...]) -> str:
    """Return the text of a message, or of a part of a service or action, without a mistake.

    Args:
        own: Messages of the same package that it may use.
    """
    types = PRIMITIVE | st.sampled_from(("string<=3", "wstring<=7", *STANDARD, *own))
    # Bounded wide strings in an unbounded sequence are a case of their own: see `test_packages.py`.
    sizes = st.sampled_from(("", "", "[]", "[1]", "[3]", "[<=5]"))
    names = draw(st.lists(FIELDS, max_size=3, unique=True))
    text = "".join(f"{draw(types)}{draw(sizes)} {name}\n" for name in names)
    return text.replace("wstring<=7[]", "wstring<=7[<=7]")


@st.composite
def packages(draw: st.DrawFn) -> dict[str, str]:
    """Return the files of a package: its messages use each other, a service and an action use them."""
    names = ("Wheel", "Axle")[: draw(st.integers(1, 2))]
    files = {f"msg/{name}.msg": draw(parts(names[:index])) for index, name in enumerate(names)}
    if draw(st.booleans()):
        files["srv/Turn.srv"] = "---\n".join(draw(parts(names)) for _ in range(2))
    if draw(st.booleans()):
        files["action/Drive.action"] = "---\n".join(draw(parts(names)) for _ in range(3))
    return files
