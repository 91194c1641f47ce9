"""Comments of definitions: kept by generated and hand-written classes, shown by `help` and in their text."""

from __future__ import annotations

import importlib
import inspect
import pydoc
import sys
from types import ModuleType
from typing import TYPE_CHECKING, Any
from unittest import mock

import pytest
from hypothesis import given
from hypothesis import strategies as st

from actors.interfaces.comments import Comments, comments_of
from actors.interfaces.generator import generate, render_package
from actors.interfaces.message import Action, Message, Service, message_class
from actors.interfaces.parser import parse
from actors.interfaces.registry import source_of
from actors.interfaces.std_msgs.msg import String

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from actors.interfaces.specs import MessageSpec

SCAN = """# A scan.
#
#   - indented \\n "quoted" \"\"\"

uint8 A=1 # first
                 # goes on
# about angle
#  with two lines

float32 angle  # "start" [rad]
string s "a # b" # x's "
int32 bare
# of nothing
"""


class Reading(Message):
    """One measurement.

    In a room.
    """

    celsius: float = 0.0
    """Temperature of the air [°C]."""
    sensor: str = ""


class Precise(Reading):
    """One measurement, with its error."""

    sensor: str = ""
    """Where."""
    error: float = 0.0
    """Of one standard deviation [°C].

    Zero if unknown.
    """


class Measure(Service):
    """Measure once."""

    class Request(Message):
        """Where to measure."""

        sensor: str = ""
        """Its name."""

    class Response(Message):
        celsius: float = 0.0
        """What it says [°C]."""


class Drive(Action):
    class Goal(Message):
        metres: float = 0.0
        """How far [m]."""

    class Result(Message):
        pass

    class Feedback(Message):
        pass


def _parsed(text: str, kind: str = "msg") -> tuple[MessageSpec, ...]:
    return parse(text, "a_msgs", kind, "Foo").parts


def _comments(part: MessageSpec) -> dict[str, str]:
    constants = {each.name: each.comment for each in part.constants}
    return constants | {each.name: each.comment for each in part.fields}


def test_the_lines_that_a_comment_belongs_to() -> None:
    """As in rosidl: first lines, lines above, the same line, and indented lines below."""
    (part,) = _parsed(SCAN)
    assert part.comment == 'A scan.\n\n  - indented \\n "quoted" """'
    assert _comments(part) == {
        "A": "first\ngoes on",
        "angle": 'about angle\n with two lines\n"start" [rad]',
        "s": "x's \"",
        "bare": "",
    }
    # A blank first line ends the message's own comment before it has begun.
    (part,) = _parsed("\n# of x\nint8 x")
    assert (part.comment, _comments(part)) == ("", {"x": "of x"})


def test_each_part_of_a_service_has_comments() -> None:
    """The lines below the separator belong to the response."""
    request, response = _parsed("# Does it.\nint8 x # in\n---\n# The end\nint8 x # out", "srv")
    assert (request.comment, _comments(request)) == ("Does it.", {"x": "in"})
    assert (response.comment, _comments(response)) == ("The end", {"x": "out"})


def test_comments_of_classes() -> None:
    """The strings below fields, also of base classes; of a class made at run time there are none."""
    assert comments_of(Precise) == Comments(
        "One measurement, with its error.",
        {
            "celsius": "Temperature of the air [°C].",
            "sensor": "Where.",
            "error": "Of one standard deviation [°C].\n\nZero if unknown.",
        },
    )
    assert comments_of(Measure.Response) == Comments("", {"celsius": "What it says [°C]."})

    class Local(Message):
        x: int = 0
        """An inner class has them, too."""

    assert comments_of(Local).fields == {"x": "An inner class has them, too."}
    assert comments_of(message_class(String, "a/msg/B", {"x": (int, 0)})) == Comments()


def test_help_shows_them() -> None:
    """The docstring that tools read has the class's own text, and what its fields mean."""
    assert inspect.getdoc(Precise) == (
        "One measurement, with its error.\n\nAttributes:\n"
        "    celsius: Temperature of the air [°C].\n    sensor: Where.\n"
        "    error: Of one standard deviation [°C].\n\n        Zero if unknown."
    )
    assert "Temperature of the air" in pydoc.render_doc(Precise)
    assert inspect.getdoc(Measure) == (
        "Measure once.\n\nRequest:\n    sensor: Its name.\n\nResponse:\n    celsius: What it says [°C]."
    )
    assert str(inspect.getdoc(Drive)).strip() == "Goal:\n    metres: How far [m]."
    assert "How far" in pydoc.render_doc(Drive)

    class Plain(Message):
        """Only this."""

    assert Plain.__doc__ == "Only this."
    Plain.__doc__ = "That."
    assert Plain.__doc__ == "That."


def test_the_text_of_a_class_has_its_comments() -> None:
    """What `interface show` prints of a hand-written class."""
    assert source_of(Precise, comments=True) == (
        "# One measurement, with its error.\n\nfloat64 celsius  # Temperature of the air [°C].\n"
        "string sensor  # Where.\n# Of one standard deviation [°C].\n#\n# Zero if unknown.\nfloat64 error\n"
    )
    assert source_of(Measure) == "string sensor\n---\nfloat64 celsius\n"
    assert source_of(Measure, comments=True) == (
        "# Measure once.\n#\n# Where to measure.\n\nstring sensor  # Its name.\n"
        "---\nfloat64 celsius  # What it says [°C].\n"
    )


@pytest.fixture
def imported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    folder = tmp_path / "commented_msgs"
    for name, text in {
        "msg/Scan.msg": SCAN,
        "srv/Do.srv": "# Do.\n#\n# Twice\n---\n# End\nint8 x # out",
    }.items():
        (folder / name).parent.mkdir(parents=True)
        (folder / name).write_text(text, encoding="utf-8")
    generate(folder)
    monkeypatch.syspath_prepend(tmp_path)
    yield importlib.import_module
    for name in [name for name in sys.modules if name.startswith("commented_msgs")]:
        del sys.modules[name]


def test_generated_classes_keep_them(imported: Any) -> None:
    """From the text to the class and back."""
    scan = imported("commented_msgs.msg").Scan
    assert parse(source_of(scan, comments=True), "a_msgs", "msg", "Foo").parts == _parsed(SCAN)
    assert comments_of(scan).fields["A"] == "first\ngoes on"
    assert (
        source_of(imported("commented_msgs.srv").Do, comments=True)
        == "# Do.\n#\n# Twice\n\n---\n# End\n\nint8 x  # out\n"
    )


def test_a_class_whose_source_is_gone_has_no_comments(imported: Any, tmp_path: Path) -> None:
    """Comments are worth no error: a program may be installed without its source."""
    scan = imported("commented_msgs.msg").Scan
    (tmp_path / "commented_msgs/msg/_scan.py").unlink()
    assert comments_of(scan) == Comments()
    assert str(scan.__doc__).startswith("A scan.")


_LINE = st.text(st.characters(codec="utf-8", exclude_categories=["Cs"]), max_size=30)


@given(st.lists(_LINE, max_size=4), st.lists(_LINE, max_size=4), _LINE)
def test_any_comment_survives(own: list[str], above: list[str], beside: str) -> None:
    """Whatever characters it has: the class that is generated has the comments that were parsed."""
    lines = [line for text in (own, above, [beside]) for line in text]
    if any(len(line.splitlines()) > 1 or line.endswith(("\n", "\r")) for line in lines):
        return
    text = "".join(f"#{line}\n" for line in own) + "\n" + "".join(f"#{line}\n" for line in above)
    spec = parse(f"{text}int8 x #{beside}\n", "a_msgs", "msg", "Foo")
    source = render_package([spec], "a_msgs")["msg/_foo.py"]

    class Loader:
        def get_source(self, name: str) -> str:
            return source

    module: Any = ModuleType("comments_test_generated")
    module.__loader__ = Loader()
    exec(compile(source, "foo", "exec", dont_inherit=True), module.__dict__)  # the text under test
    with mock.patch.dict(sys.modules, {module.__name__: module}):
        found = comments_of(module.Foo)
        assert parse(source_of(module.Foo, comments=True), "a_msgs", "msg", "Foo") == spec
    part = spec.parts[0]
    assert found == Comments(part.comment, {"x": part.fields[0].comment} if part.fields[0].comment else {})
