"""Generated packages."""

from __future__ import annotations

import builtins
import importlib
import keyword
import math
import os
import subprocess
import sys
import typing
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final
from unittest import mock

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

import actors.interfaces
from actors.interfaces import message, types
from actors.interfaces.catalog import interfaces_of, standard_packages
from actors.interfaces.codec import codec_for
from actors.interfaces.errors import InterfaceSyntaxError
from actors.interfaces.fields import FieldType
from actors.interfaces.generator import generate, render_package
from actors.interfaces.interface_names import PACKAGE_NAME
from actors.interfaces.message import Message, type_hash, type_name
from actors.interfaces.parser import parse
from actors.interfaces.registry import (
    find_interface,
    source_of,
)
from actors.interfaces.specs import ConstantSpec, FieldSpec, InterfaceSpec, MessageSpec
from tests.actors.interfaces.definitions_of_each_kind import EVERYTHING, KINDS, fields, write_package

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

ROOT = Path(actors.interfaces.__file__).parent
USED = {
    "Message",
    "Service",
    "Action",
    "Annotated",
    "ClassVar",
    "AtMost",
    "Length",
    "Float64Array",
    "UInt8Sequence",
}
"""Types that generated modules import. There may be messages of these names."""


def _legal(names: Iterable[str]) -> list[str]:
    """Return the names that a field may have."""
    return sorted({name for name in names if PACKAGE_NAME.fullmatch(name) and not keyword.iskeyword(name)})


@pytest.fixture
def package(tmp_path: Path) -> Path:
    return write_package(tmp_path)


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


def test_generation_beside_the_sources_keeps_the_authors_init(package: Path) -> None:
    """Without an output folder the package is made in place; an __init__.py that is there stays."""
    (package / "__init__.py").write_text("mine = 1\n")
    written = generate(package)
    assert package / "msg" / "_point.py" in written
    assert (package / "__init__.py").read_text() == "mine = 1\n"
    before = {path: path.read_bytes() for path in written}
    generate(package)
    assert {path: path.read_bytes() for path in written} == before


@pytest.fixture
def imported(tmp_path: Path) -> Iterator[Callable[..., Any]]:
    def make(package: str, files: dict[str, str]) -> Any:
        """Generate a package and import its messages."""
        for name, text in files.items():
            path = tmp_path / package / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8")
        generate(tmp_path / package)
        importlib.invalidate_caches()
        with mock.patch.object(sys, "path", [str(tmp_path), *sys.path]):
            module = importlib.import_module(f"{package}.msg")
            return {name: getattr(module, name) for name in module.__all__}

    before = set(sys.modules)
    yield make
    for name in set(sys.modules) - before:
        # Not those of standard types: their classes stay in the packages, and lose their source otherwise.
        if name.partition(".")[0] in {each.name for each in tmp_path.iterdir()}:
            del sys.modules[name]


def _works(cls: Any) -> None:
    """Check that a class sends and receives what its text says."""
    package, kind, name = type_name(cls).split("/")
    assert codec_for(cls).decode(codec_for(cls).encode(cls(x5=math.nan))) is not None
    spec = parse(source_of(cls), package, kind, name)
    assert [field.name for field in spec.parts[0].fields] == list(cls.__struct_fields__)


def test_fields_may_have_any_name(imported: Any) -> None:
    """Also those that the generated module uses itself, or Python: alone, and all in one message."""
    names = _legal(
        [*dir(builtins), *dir(typing), *dir(types), *dir(message), *dir(Message), *dir(msgspec), "msgspec"]
    )
    assert {"list", "str", "bool", "int32", "float", "bytes", "msgspec", "type", "range", "field"} <= {*names}
    files = {f"msg/M{number}.msg": fields(name) for number, name in enumerate(names)}
    files["msg/All.msg"] = "\n".join(
        f"{KINDS[n % len(KINDS)].format('', name)}" for n, name in enumerate(names)
    )
    classes = imported("any_field_msgs", files)
    for number, name in enumerate(names):
        cls = classes[f"M{number}"]
        _works(cls)
        assert getattr(cls(), name) == 3
    assert list(classes["All"].__struct_fields__) == names
    assert codec_for(classes["All"]).encode(classes["All"]())


def test_fields_in_idl_may_have_the_name_of_a_type(imported: Any) -> None:
    """As of the message in them, or of what the generated module imports."""
    names = ["Header", "StdMsgsHeader", "Message", "Annotated", "AtMost", "Length", "Foo"]
    members = "".join(f"std_msgs::msg::Header {each}; " for each in names)
    text = f"module a_idl_msgs {{ module msg {{ struct Foo {{ {members} sequence<long, 3> x; }}; }}; }};"
    foo = imported("a_idl_msgs", {"msg/Foo.idl": text})["Foo"]
    assert codec_for(foo).decode(codec_for(foo).encode(foo())) == foo()
    assert [type_name(type(getattr(foo(), each))) for each in names] == ["std_msgs/msg/Header"] * len(names)


def test_messages_and_constants_may_have_any_name(imported: Any) -> None:
    """Those that the generated module uses itself; and names of constants that are names of messages."""
    files = {f"msg/{name}.msg": fields("x") for name in USED}
    files["msg/UUID.msg"] = "int8 UUID=1\nint8 SLOT_TYPES=2\nunique_identifier_msgs/UUID id"
    files |= {f"msg/Of{name}.msg": fields("x", f"{name} own\n{name}[2] two\n") for name in [*USED, "UUID"]}
    files["msg/Same.msg"] = "std_msgs/Int8 a\nexample_interfaces/Int8 b\nInt8 c\nint8 int8"
    files["msg/Int8.msg"] = files["msg/StdMsgsInt8.msg"] = "StdMsgsInt16 x"
    files["msg/StdMsgsInt16.msg"] = "std_msgs/Int16 x"
    classes = imported("any_type_msgs", files)
    for name in USED:
        _works(classes[name])
        _works(classes[f"Of{name}"])
        assert type(classes[f"Of{name}"]().own) is classes[name]
    assert (classes["UUID"].UUID, type_name(type(classes["UUID"]().id))) == (
        1,
        "unique_identifier_msgs/msg/UUID",
    )
    same = [type_name(type(getattr(classes["Same"](), field))) for field in "abc"]
    assert same == ["std_msgs/msg/Int8", "example_interfaces/msg/Int8", "any_type_msgs/msg/Int8"]
    assert type_name(type(classes["StdMsgsInt16"]().x)) == "std_msgs/msg/Int16"


@given(
    st.lists(st.sampled_from(_legal(dir(builtins))) | st.just("a" * 100), unique=True, max_size=4),
    st.text(max_size=200)
    | st.sampled_from(["(" * 90, ")" * 120, "=" * 100, '"' * 60, "'\"" * 40, "[#" * 60]),
)
def test_what_is_generated_compiles_and_is_formatted_alike(names: list[str], value: str) -> None:
    """Whatever a value contains, and however long it is: the constant has it."""
    string = FieldType("string")
    fields = [FieldSpec(name, string, value, value.strip()) for name in names]
    list_of = FieldSpec("values", FieldType("string", is_array=True), [value, value])
    part = MessageSpec((*fields, list_of), (ConstantSpec("VALUE", string, value),), "")
    text = render_package([InterfaceSpec("a_msgs", "msg", "Foo", (part,))], "a_msgs")["msg/_foo.py"]
    namespace: dict[str, Any] = {"__name__": "a_msgs.msg._foo"}
    exec(compile(text, "foo", "exec", dont_inherit=True), namespace)
    made = namespace["Foo"]()
    assert (made.VALUE, made.values) == (value, [value, value])
    assert all(getattr(made, name) == value for name in names)


@pytest.mark.parametrize(
    ("files", "reason"),
    [
        ({"msg/A.msg": "B b", "msg/B.msg": "A[] a"}, "a_msgs/msg/A -> a_msgs/msg/B -> a_msgs/msg/A"),
        ({"msg/A.msg": "A a"}, "a_msgs/msg/A -> a_msgs/msg/A"),
        ({"msg/A.msg": "Missing a"}, "a_msgs/msg/Missing, which is not in the package"),
        ({"msg/URL.msg": "", "msg/Url.msg": ""}, "same module name"),
        ({f"msg/M{at}.msg": f"M{at + 1} next" for at in range(1200)}, "more than 64 levels deep"),
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


CIRCLE: Final = {"aa/msg/A.msg": "bb/B b\n", "bb/msg/B.msg": "cc/C[] c\n", "cc/msg/C.msg": "aa/A[<=3] a\n"}


def _write(folder: Path, files: dict[str, str]) -> None:
    for name, text in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")


@pytest.mark.parametrize("package", ["aa", "bb", "cc"])
def test_packages_whose_messages_contain_each_other_are_refused(tmp_path: Path, package: str) -> None:
    """Case 84: none of them could be imported; the error says which messages these are."""
    _write(tmp_path, CIRCLE)
    with pytest.raises(InterfaceSyntaxError, match=r"contain one another: .*aa/msg/A -> bb/msg/B"):
        generate(tmp_path / package, tmp_path / "out")
    assert not (tmp_path / "out").exists()


@pytest.mark.processes
def test_packages_that_use_each_other_can_be_imported(tmp_path: Path) -> None:
    """Case 84: in another process, of what was written: also long constants with brackets in their text."""
    text = "a (b" * 40
    files = {
        "aa/msg/A.msg": f'bb/B b\nstring TEXT="{text}"\nstring value "({text})"\n',
        "aa/msg/Z.msg": "int32 float\nint32[] bytes\nbyte[] msgspec\nfloat64[3] list\n",
        "bb/msg/B.msg": "aa/Z z\n",
        "bb/msg/Import.msg": "aa/A a\n",
    }
    _write(tmp_path, files)
    for package in ("aa", "bb"):
        generate(tmp_path / package, tmp_path / "out")
    code = (
        f"import sys; sys.path[:0] = {[str(tmp_path / 'out'), str(ROOT.parents[1])]!r}\n"
        "import aa.msg, bb.msg\n"
        "for package in (aa.msg, bb.msg):\n"
        "    for name in package.__all__: getattr(package, name)(); print(name)\n"
        f"assert aa.msg.A.TEXT == {text!r}\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60
    )
    assert done.stdout.split() == ["A", "Z", "B", "Import"]


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs named pipes")
@pytest.mark.parametrize("name", ["Pipe.msg", "Pipe.idl"])
def test_a_named_pipe_among_the_files_is_refused(tmp_path: Path, name: str) -> None:
    """Case 86: reading it would never end; the error names it."""
    _write(tmp_path, {"aa/msg/A.msg": "int32 x\n"})
    os.mkfifo(tmp_path / "aa" / "msg" / name)
    with pytest.raises(OSError, match="not a regular file") as raised:
        generate(tmp_path / "aa")
    assert raised.value.filename == str(tmp_path / "aa" / "msg" / name)


@pytest.mark.parametrize("link", ["msg", "msg/_a.py", "msg/__init__.py", "py.typed"])
def test_nothing_is_written_through_a_link_to_elsewhere(tmp_path: Path, link: str) -> None:
    """Case 86: of files and of folders; nothing else is written, either."""
    _write(tmp_path, {"aa/msg/A.msg": "int32 x\n"})
    elsewhere = tmp_path / "elsewhere"
    if link == "msg":
        elsewhere.mkdir()
    else:
        elsewhere.write_text("precious", encoding="utf-8")
    target = tmp_path / "out" / "aa" / link
    target.parent.mkdir(parents=True)
    target.symlink_to(elsewhere)
    with pytest.raises(InterfaceSyntaxError, match="a link to elsewhere") as raised:
        generate(tmp_path / "aa", tmp_path / "out")
    assert str(tmp_path / "out" / "aa") in str(raised.value)
    assert link == "msg" or elsewhere.read_text(encoding="utf-8") == "precious"
    assert link != "msg" or not any(elsewhere.iterdir())
    assert [path for path in (tmp_path / "out").rglob("*") if path.is_file()] in ([], [target])
