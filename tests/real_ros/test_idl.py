"""`.idl` files mean the same as in ROS 2, or are refused alike."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from dataclasses import replace
from typing import TYPE_CHECKING, Final

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from actors.interfaces.errors import InterfaceSyntaxError
from actors.interfaces.idl import parse_idl
from actors.interfaces.parser import parse_file
from actors.interfaces.specs import PARTS
from tests.real_ros import REAL_PYTHON
from tests.real_ros.differences import agree
from tests.real_ros.test_definitions import PACKAGE, REFUSED, parts_of

if TYPE_CHECKING:
    from pathlib import Path

    from actors.interfaces.fields import FieldType
    from actors.interfaces.specs import InterfaceSpec
    from tests.real_ros.sides import Side

SHARE: Final = REAL_PYTHON.parent.parent / "share"
FILES: Final = [path for kind in PARTS for path in sorted(SHARE.glob(f"*/{kind}/*.idl"))]
STRUCTS: Final = {
    "msg": "struct Probe {{ {0} }};",
    "srv": "struct Probe_Request {{ {0} }}; struct Probe_Response {{ {0} }};",
    "action": "struct Probe_Goal {{ {0} }}; struct Probe_Result {{ {0} }}; struct Probe_Feedback {{ {0} }};",
}
HASHES: Final = """
import json, sys
from actors.interfaces.file_packages import install_finder
from actors.interfaces.message import type_hash
from actors.interfaces.registry import find_interface
install_finder()
print(json.dumps({name: type_hash(find_interface(name)) for name in sys.argv[1:]}))
"""

MEMBERS: Final = (
    "long a;",
    "long a, b, c[2];",
    "short a; unsigned short b; long c; unsigned long d; long long e; unsigned long long f;",
    "int8 a; uint8 b; int16 c; uint16 d; int32 e; uint32 f; int64 g; uint64 h;",
    "float a; double b; boolean c; octet d; string e; wstring f;",
    "string<5> a; wstring<5> b; sequence<string<5>> c; sequence<string<5>, 3> d;",
    "sequence<wstring<5>> a;",
    "sequence<wstring<5>, 3> a;",
    "sequence<long> a; sequence<long, 5> b; long c[5]; string<5> d[5];",
    "std_msgs::msg::Header a; sequence<std_msgs::msg::Header> b; std_msgs::msg::Header c[2];",
    "::std_msgs::msg::Header a;",
    "Header a;",
    "long double a;",
    "char a;",
    "wchar a;",
    "sequence<sequence<long>> a;",
    "sequence<long> a[2];",
    "long a[2][2];",
    "long a[0];",
    "string<0> a;",
    "sequence<long, 0> a;",
    "long a[N];",
    "long a",
    "",
    "uint8 structure_needs_at_least_one_member;",
    "@key long a;",
    "@optional @key long a;",
    "@range (min=-10, max=10) long a;",
    "@bit_bound(8) long a;",
    "@default (value=5) long a, b;",
    "@default (value=-5) long a;",
    "@default (value=5) double a;",
    "@default (value=1.9e10) float a; @default (value=.1) float b; @default (value=9e-05) float c;",
    "@default (value=1.) float a; @default (value=8.7d) float b; @default (value=7D) float c;",
    "@default (value=TRUE) boolean a; @default (value=FALSE) boolean b;",
    "@default (value=true) boolean a; @default (value=false) boolean b;",
    '@default (value="a" "b") string a;',
    '@default (value="") string a;',
    r'@default (value="a\"b\x41\103\\c\?") string a;',
    r'@default (value=L"\u00fc\x41") wstring a;',
    '@default (value="(1, 2)") sequence<long> a;',
    "@default (value=\"('a', 'b')\") sequence<string> a;",
    "@default (value=0x10) long a;",
    "@default (value=010) long a;",
    "@default (value=+5) long a;",
    "@default (5) long a;",
    f"@default (value={'1' * 40}) double a;",
    "sequence<long, 010> a;",
    "string<010> a;",
    "@default (value=1 + 2) long a;",
    "@default (value=300) uint8 a;",
    '@default (value="x") long a;',
    '@verbatim (language="comment", text="a" "\\n" "b") long a;',
    "// long a;\nlong b; /* long\n c; */",
    "long class_;",
    "long Upper;",
    "long _a;",
)
DEFINITIONS: Final = (
    "typedef double triple[3]; struct Probe { triple a; };",
    "typedef std_msgs::msg::Header H; typedef H H2[2]; struct Probe { H2 a; sequence<H> b; };",
    "typedef string<5> tag; struct Probe { tag a; sequence<tag> b; };",
    "typedef long a, b; struct Probe { long x; };",
    "typedef long a; typedef long a; struct Probe { a x; };",
    "typedef long a; typedef short a; struct Probe { long x; };",
    "typedef sequence<long> a; struct Probe { a x; sequence<a> y; };",
    "struct Probe { later x; }; typedef long later;",
    "enum E { A, B }; struct Probe { long x; };",
    "enum E { A, B }; struct Probe { E x; };",
    "struct Other; struct Probe { long x; };",
    "struct Other { long y; }; struct Probe { long x; };",
    "module Probe_Constants { const short A = -2; const float C = 1.25; }; struct Probe { long x; };",
    'module Probe_Constants { const string A = "a" "b"; const wstring B = L"\\u2122"; }; struct Probe { long x; };',  # noqa: E501
    "module Other_Constants { const short A = 1; }; struct Probe { long x; };",
    "const short A = 1; struct Probe { long x; };",
    "module Probe_Constants { }; struct Probe { long x; };",
    "union Probe switch (long) { case 1: long x; };",
    "struct Probe : Other { long x; };",
    "struct Probe { };",
    "@verbatim (language='comment') struct Probe { long x; };",
    "@topic struct Probe { long x; };",
    "struct Probe { long x; }",
    "#define X",
)


def in_modules(kind: str, definitions: str) -> str:
    """Return the text of a file."""
    return f"module {PACKAGE} {{ module {kind} {{\n{definitions}\n}}; }};\n"


CASES = [
    *((kind, in_modules(kind, STRUCTS[kind].format(MEMBERS[0]))) for kind in PARTS),
    *(("msg", in_modules("msg", STRUCTS["msg"].format(each))) for each in MEMBERS),
    *(("msg", in_modules("msg", each)) for each in DEFINITIONS),
]


def answer_of(kind: str, text: str) -> object:
    """Return what callboard reads."""
    try:
        return parts_of(parse_idl(text, PACKAGE, kind, "Probe"))
    except InterfaceSyntaxError:
        return REFUSED


def _agree(kind: str, text: str, real: Side) -> None:
    asked = real.ask("definitions.parse_idl", text)
    truth = REFUSED if asked.raised else asked.returned
    short = text.partition("{\n")[2].rpartition("\n}; };")[0]
    agree("idl", short, real=truth, callboard=answer_of(kind, text))


@pytest.mark.parametrize(("kind", "text"), CASES)
def test_a_file_is_read_alike(kind: str, text: str, real: Side) -> None:
    """Fields, types, bounds, defaults and constants are equal, or both refuse it."""
    _agree(kind, text, real)


_TYPES = st.sampled_from(
    ["long", "unsigned long long", "octet", "double", "string", "string<3>", "a_msgs::msg::B"]
)
_MEMBER = st.one_of(
    st.builds("{} {};".format, _TYPES, st.sampled_from(["x", "y", "z"])),
    st.builds("{} {}[{}];".format, _TYPES, st.sampled_from(["x", "y"]), st.integers(1, 5)),
    st.builds("sequence<{}> {};".format, _TYPES, st.sampled_from(["x", "z"])),
    st.builds("sequence<{}, {}> z;".format, _TYPES, st.integers(1, 5)),
    st.builds("@default (value={}) long long {};".format, st.integers(-9, 9), st.sampled_from(["x", "y"])),
)


@settings(max_examples=15)
@given(members=st.lists(_MEMBER, min_size=1, max_size=4, unique_by=lambda each: each.split()[-1][:1]))
def test_members_are_read_alike(members: list[str], real: Side) -> None:
    """So are structs of several."""
    _agree("msg", in_modules("msg", STRUCTS["msg"].format(" ".join(members))), real)


def _bare(spec: InterfaceSpec) -> InterfaceSpec:
    """Return a specification without comments; IDL has no `char` as `.msg` files mean it."""
    parts = [
        replace(
            part,
            comment="",
            fields=tuple(replace(each, comment="", type=_bare_type(each.type)) for each in part.fields),
            constants=tuple(replace(each, comment="", type=_bare_type(each.type)) for each in part.constants),
        )
        for part in spec.parts
    ]
    return replace(spec, parts=tuple(parts))


def _bare_type(kind: FieldType) -> FieldType:
    return replace(kind, base="uint8") if kind.base == "char" else kind


def test_every_file_of_the_wheels_is_the_type_of_its_text() -> None:
    """A build makes an `.idl` file of each `.msg`, `.srv` and `.action`: both give the same type."""
    pairs = 0
    for path in FILES:
        package = path.parent.parent.name
        spec = parse_file(path, package)
        text = path.with_suffix(f".{path.parent.name}")
        if text.exists():
            pairs += 1
            assert _bare(spec) == _bare(parse_file(text, package)), path
    assert pairs > 190


def test_hashes_of_types_that_are_only_idl(tmp_path: Path) -> None:
    """They are what the wheels say of them."""
    expected: dict[str, str] = {}
    for path in FILES:
        if path.parent.parent.name == "test_msgs":
            target = tmp_path / path.relative_to(SHARE)
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(path, target)
            described = json.loads(path.with_suffix(".json").read_text())["type_hashes"]
            name = "/".join(path.relative_to(SHARE).with_suffix("").parts)
            expected[name] = next(each["hash_string"] for each in described if each["type_name"] == name)
    assert len(expected) > 20
    command = [sys.executable, "-c", HASHES, *expected]
    done = subprocess.run(
        command,
        check=True,
        capture_output=True,
        cwd=tmp_path,
        env={"PYTHONPATH": f"{REAL_PYTHON.parents[3]}:{tmp_path}"},
    )
    assert json.loads(done.stdout) == expected
