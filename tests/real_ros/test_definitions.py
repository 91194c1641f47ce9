"""`.msg`, `.srv` and `.action` text means the same as in ROS 2, or is refused alike."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from actors.interfaces.errors import InterfaceSyntaxError
from actors.interfaces.parser import parse, read_source
from actors.interfaces.specs import PARTS
from tests.real_ros import REAL_PYTHON
from tests.real_ros.definition_texts import lines
from tests.real_ros.differences import agree

if TYPE_CHECKING:
    from actors.interfaces.specs import InterfaceSpec
    from tests.real_ros.sides import Side

PACKAGE = "robot_msgs"
REFUSED = "refused"

MESSAGES = (
    "",
    "\n\n",
    "# only a comment",
    "# first\nint32 a # second\n# third",
    " int32 a",
    "int32\ta\t5",
    "int32 a\r\nint32 b\r\n",
    "int32 a\nint32 a",
    "int32 A=1\nint32 A=2",
    "int32 a=5",
    "int32 A 5",
    "int32 A",
    "int32",
    "---",
    "\ufeffint32 a",
    "int32\u00a0a",
    "int32 a\u2028int32 b",
    "int32 list\nfloat32 str",
    'string s "a#b"',
    'string S="a#b"',
    "string s don't # x",
    "string s it's one # it's two",
    "string S=it's one # it's two",
    """string[] s [it's, 5"] # it's 5\"""",
    'string s "a',
    "string S='a",
    r'string s "a\nb"',
    r'string s "a\\b"',
    r"string s a\nb",
    r"string s a\tb",
    r"string S=C:\temp",
    r"string S='\x41\u0042\103\a\d\8'",
    r"string s 'two \\\\ for one'",
    r"string s 'a\\'b'",
    r"wstring s 'ü\t'",
    "string s 'a' 'b'",
    "string s 'a'b'",
    "string<=3 S=abc",
    "uint8 A=08",
    "uint8 A=010",
    "int8 A=-0_8",
    "int8 A=+0x_f",
    "char A=007",
    "int32[] a [0x1, 08]",
    "string[] s [it's, 5\"]",
    r"string[] s [\\x41, \n, '\\\\n\\d', \\\\]",
    r"wstring[] s ['a\\b', \u0041\101\?, 'it\'s', \"\"]",
    "string[] s ['a' 'b']",
    "string[] s ['a'b]",
    "int32 lambda",
    "string from",
    "int32 match\nint32 type\nint32 self",
    "Pose_Request p",
    "Sample_Pose p",
    "Header header",
    "builtin_interfaces/Time t",
    "int32[007] a",
    "int32[2097152] a",
    "string s a = b",
    "string s x=y",
    "string s 'x=y'",
    "string A=a=b",
    "string<=2 s abc",
    "string<=2[] s ['abc']",
    "string[] s ['a, b', \"c\"]",
    "int32[] a [1,]",
    "int32[] a [ ]",
    "int32[2] a [1]",
    "int32[<=2] a [1, 2, 3]",
    "std_msgs/Header header",
    "a/msg/Pose p",
    "Pose p 1",
    "Pose[] p []",
    "time t",
    "duration d",
    "int32[+2] a",
    "int32[1_0] a",
    "string<=+2 s",
    "int32[٣] a",
    "uint8[<=4294967295] big",
    "uint8[<=4294967296] big",
    "string<=4294967296 s",
    "int32 a # = 5",
    "int32 a ٣",
    "float32 f 1,5",
    "float32 F=1e400",
    "float32 f nan",
    "bool b yes",
    "byte b -1",
    "char c 'a'",
    "char c 256",
    "int8 a 1.0",
    "uint64 a 18446744073709551616",
)
SERVICES = (
    "int32 a\n---\nint32 b",
    "int32 a\n---\nint32 a",
    "---",
    "# x\n---\n# y\n",
    "int32 a",
    "---\n---",
    "int32 a\n ---\nint32 b",
    "int32 a\n--- \nint32 b",
)
ACTIONS = (
    "---\n---",
    "int32 a\n---\nint32 a\n---\nint32 a",
    "---",
    "int32 a\n---\n---\n---\n",
)
CASES = [
    *(("msg", text) for text in MESSAGES),
    *(("srv", text) for text in SERVICES),
    *(("action", text) for text in ACTIONS),
]


def truth_of(real: Side, kind: str, text: str) -> object:
    """Return what ROS 2 reads in a text; "refused" if it raises."""
    answer = real.ask("definitions.parse", kind, text)
    return REFUSED if answer.raised else answer.returned


def answer_of(kind: str, text: str) -> object:
    """Return what callboard reads in a text, in the form of `programs/definitions.py`."""
    try:
        return parts_of(parse(text, PACKAGE, kind, "Probe"))
    except InterfaceSyntaxError:
        return REFUSED


def parts_of(spec: InterfaceSpec) -> object:
    """Return a specification in the form of `programs/definitions.py`."""
    return [
        {
            "fields": [(field.name, str(field.type), plain(field.default)) for field in part.fields],
            "constants": [(each.name, str(each.type), plain(each.value)) for each in part.constants],
        }
        for part in spec.parts
    ]


def plain(value: Any) -> Any:
    """Return a value as rosidl_adapter has it: a byte is a number."""
    if isinstance(value, list):
        return [plain(each) for each in value]
    return value[0] if isinstance(value, bytes) else value


@pytest.mark.parametrize(("kind", "text"), CASES)
def test_a_text_is_read_alike(kind: str, text: str, real: Side) -> None:
    """Fields, types, bounds, defaults and constants are equal, or both refuse it."""
    agree("definition", text, real=truth_of(real, kind, text), callboard=answer_of(kind, text))


@given(text=lines())
def test_a_line_is_read_alike(text: str, real: Side) -> None:
    """So are lines made of types, names and values of which one may be wrong."""
    agree("definition", text, real=truth_of(real, "msg", text), callboard=answer_of("msg", text))


@given(parts=st.lists(st.lists(lines(), max_size=4).map("\n".join), min_size=2, max_size=3))
def test_a_service_or_action_is_read_alike(parts: list[str], real: Side) -> None:
    """So are several lines in each of two or three parts."""
    kind, text = ("srv", "action")[len(parts) - 2], "\n---\n".join(parts)
    agree("definition", text, real=truth_of(real, kind, text), callboard=answer_of(kind, text))


SHARE = REAL_PYTHON.parent.parent / "share"


@pytest.mark.parametrize("package", sorted({path.parent.parent.name for path in SHARE.glob("*/*/*.idl")}))
def test_files_of_a_package_are_read_alike(package: str, real: Side) -> None:
    """All `.msg`, `.srv` and `.action` files in the wheels."""
    for file in (file for kind in PARTS for file in sorted((SHARE / package / kind).glob(f"*.{kind}"))):
        kind, text = file.parent.name, read_source(file)
        answer = parts_of(parse(text, PACKAGE, kind, "Probe"))
        agree(
            "definition file", str(file.relative_to(SHARE)), real=truth_of(real, kind, text), callboard=answer
        )


@pytest.mark.parametrize("package", sorted(path.name for path in SHARE.glob("*_msgs")))
def test_comments_belong_to_the_same_elements(package: str, real: Side) -> None:
    """Those of all files in the wheels. ROS 2 keeps a unit apart, such as `[m]`."""
    for file in (file for kind in PARTS for file in sorted((SHARE / package / kind).glob(f"*.{kind}"))):
        kind, text = file.parent.name, read_source(file)
        truth = real.call("definitions.comments", kind, text)
        answer: list[object] = []
        for part, theirs in zip(parse(text, package, kind, file.stem).parts, truth, strict=True):
            ours = {each.name: each.comment for each in part.constants} | {
                each.name: each.comment for each in part.fields
            }
            units = {name: unit for name, _, unit in theirs}
            answer.append(
                {name: _words(text, units[name]) for name, text in {"": part.comment, **ours}.items()}
            )
        expected = [{name: _words("\n".join(lines), None) for name, lines, _ in part} for part in truth]
        agree("comments", str(file.relative_to(SHARE)), real=expected, callboard=answer)


def _words(text: str, unit: str | None) -> list[str]:
    return re.sub(rf"\s*\[{re.escape(unit)}\]", "", text).split() if unit else text.split()
