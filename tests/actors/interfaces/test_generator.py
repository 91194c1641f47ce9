"""Generated packages."""

from __future__ import annotations

import importlib
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import actors.interfaces
from actors.interfaces.catalog import interfaces_of, standard_packages
from actors.interfaces.codec import codec_for
from actors.interfaces.errors import InterfaceSyntaxError
from actors.interfaces.generator import generate, render_package
from actors.interfaces.message import type_hash, type_name
from actors.interfaces.parser import parse
from actors.interfaces.registry import (
    find_interface,
    source_of,
)

ROOT = Path(actors.interfaces.__file__).parent
EVERYTHING = """
int8 LOW=-5
string NAME="a \\"b\\""
byte B=3
std_msgs/Header header
geometry_msgs/Point point
Point own_point
std_msgs/Int8MultiArray array
bool yes true
byte one 7
char letter 65
float32 f 1.5
float64 inf_value inf
int64 i -5
uint64 big 18446744073709551615
string s "it's \\"quoted\\""
string<=5 bounded
wstring wide
uint8[] data [1, 2]
byte[4] four
uint8[<=9] some
float64[] doubles [1, 2.5]
float64[3] three
int32[<=3] few [7]
bool[2] flags
string[] texts ["a", 'b']
string<=3[2] pair
Point[] points
Point[2] two
geometry_msgs/Pose[<=3] a_very_long_field_name_that_makes_the_line_too_long_for_the_formatter_and_must_wrap
"""


@pytest.fixture
def package(tmp_path: Path) -> Path:
    folder = tmp_path / "robot_test_msgs"
    for name, text in {
        "msg/Everything.msg": EVERYTHING,
        "msg/Point.msg": "float32 x\nfloat32 y",
        "msg/Empty.msg": "# nothing",
        "srv/Home.srv": "Point where\n---\nbool ok\nstring message",
        "srv/Nothing.srv": "---",
        "action/Drive.action": "Point to\n---\nfloat64 length\n---\nPoint at",
    }.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    return folder


@pytest.mark.parametrize("package", standard_packages())
def test_the_standard_packages_are_what_would_be_generated(package: str) -> None:
    """Each class's own text, parsed and generated again, gives the committed source."""
    texts = {name: source_of(find_interface(name), comments=True) for name in interfaces_of(package)}
    specs = [parse(text, *name.split("/")) for name, text in texts.items()]
    for name, text in render_package(specs, f"actors.interfaces.{package}").items():
        assert (ROOT / package / name).read_text(encoding="utf-8") == text, name
    present = {path.relative_to(ROOT / package).as_posix() for path in (ROOT / package).rglob("*.py")}
    assert present == {name for name in render_package(specs, "x") if name.endswith(".py")}


def test_a_generated_package_works(package: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Import, defaults, constants, round trip, source text, lookup."""
    written = generate(package, tmp_path / "out")
    assert all(path.is_file() for path in written)
    monkeypatch.syspath_prepend(tmp_path / "out")
    messages: Any = importlib.import_module("robot_test_msgs.msg")
    message = messages.Everything()
    codec: Any = codec_for(messages.Everything)
    assert codec.decode(codec.encode(message)) == message
    assert (message.LOW, message.NAME, message.B) == (-5, 'a "b"', b"\x03")
    assert (message.one, message.letter, message.big, message.s) == (b"\x07", 65, 2**64 - 1, 'it\'s "quoted"')
    assert (bytes(message.data), message.doubles, message.few, message.texts) == (
        b"\1\2",
        [1, 2.5],
        [7],
        ["a", "b"],
    )
    assert (bytes(message.four), message.three, message.flags) == (bytes(4), [0.0] * 3, [False, False])
    assert type(message.two[1]) is messages.Point
    assert message.own_point is not message.two[0]
    assert type_name(type(message.point)) == "geometry_msgs/msg/Point"
    assert type_name(find_interface("robot_test_msgs/Home")) == "robot_test_msgs/srv/Home"
    again = parse(source_of(messages.Everything), "robot_test_msgs", "msg", "Everything")
    assert again == parse(EVERYTHING, "robot_test_msgs", "msg", "Everything")
    for name in interfaces_of("robot_test_msgs"):
        assert type_hash(find_interface(name)).startswith("RIHS01_")
    for name in list(sys.modules):
        if name.startswith("robot_test_msgs"):
            monkeypatch.delitem(sys.modules, name)


def test_generated_source_is_clean(package: Path, tmp_path: Path) -> None:
    """Formatted, and accepted by ruff and mypy --strict."""
    out = tmp_path / "out"
    generate(package, out)
    tools = Path(sys.executable).parent
    for command in (
        ["ruff", "format", "--isolated", "--line-length=110", "--check", "."],
        ["ruff", "check", "--isolated", "--line-length=110", "--select=E,F,W,I,UP,B,RUF,TC", "."],
        [
            "mypy",
            "--strict",
            "--no-incremental",
            f"--cache-dir={tmp_path / 'cache'}",
            "--config-file=",
            "robot_test_msgs",
        ],
    ):
        if shutil.which(command[0], path=str(tools)) is None:
            pytest.skip(f"{command[0]} is not installed")
        done = subprocess.run(
            [tools / command[0], *command[1:]],
            cwd=out,
            env={**os.environ, "MYPYPATH": str(ROOT.parents[1])},
            capture_output=True,
            text=True,
            check=False,
        )
        # mypy also reports on what the package imports, and that is not this test's business.
        clean = done.returncode == 0 or (command[0] == "mypy" and "robot_test_msgs" not in done.stdout)
        assert clean, done.stdout + done.stderr


def test_generation_beside_the_sources_keeps_the_authors_init(package: Path) -> None:
    """Without an output folder the package is made in place; an __init__.py that is there stays."""
    (package / "__init__.py").write_text("mine = 1\n")
    written = generate(package)
    assert package / "msg" / "_point.py" in written
    assert (package / "__init__.py").read_text() == "mine = 1\n"
    before = {path: path.read_bytes() for path in written}
    generate(package)
    assert {path: path.read_bytes() for path in written} == before


@pytest.mark.parametrize(
    ("files", "reason"),
    [
        ({"msg/A.msg": "B b", "msg/B.msg": "A[] a"}, "a_msgs/msg/A -> a_msgs/msg/B -> a_msgs/msg/A"),
        ({"msg/A.msg": "A a"}, "a_msgs/msg/A -> a_msgs/msg/A"),
        ({"msg/A.msg": "Missing a"}, "a_msgs/msg/Missing, which is not in the package"),
        ({"msg/A.msg": "string str"}, "Field 'str' hides"),
        ({"msg/A.msg": "int8[] list\nstring[] x"}, "Field 'list' hides"),
        ({"msg/URL.msg": "", "msg/Url.msg": ""}, "same module name"),
        ({}, "No interfaces"),
    ],
)
def test_broken_packages_are_reported(tmp_path: Path, files: dict[str, str], reason: str) -> None:
    """Circles are named; nothing is written."""
    folder = tmp_path / "a_msgs"
    folder.mkdir()
    for name, text in files.items():
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text(text)
    with pytest.raises(InterfaceSyntaxError, match=reason):
        generate(folder)
    assert not list(folder.rglob("*.py"))


def test_a_bad_folder_name_is_reported(tmp_path: Path) -> None:
    """The folder's name is the package's."""
    with pytest.raises(InterfaceSyntaxError, match="not a package name"):
        generate(tmp_path / "Bad-Name")
