"""Classes of interface packages in `share` of ROS 2's prefixes, made from their files."""

from __future__ import annotations

import importlib
import sys
from functools import partial
from itertools import count
from typing import TYPE_CHECKING, Any

import pytest

from actors.interfaces.catalog import SHARE_ROOT, interfaces_of, known_packages, share_folders, source_file
from actors.interfaces.codec import codec_for
from actors.interfaces.comments import comments_of
from actors.interfaces.errors import UnknownInterfaceError
from actors.interfaces.file_packages import FileFinder, install_finder
from actors.interfaces.generator import generate
from actors.interfaces.message import Message, type_hash, type_name
from actors.interfaces.registry import find_interface, installed_interface, interface_source
from actors.interfaces.share_packages import add_share_folders
from actors.interfaces.std_msgs.msg import Header, String
from tests.calls import calls_of
from tests.interfaces.shares import no_shares

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

_NUMBERS = count()


class Own:
    """Gives packages names that no other test has: a class is never forgotten."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self._prefix = f"share{next(_NUMBERS)}_"

    def __call__(self, text: str) -> str:
        """Return a text in which "share_" is this test's."""
        return text.replace("share_", self._prefix)

    def find(self, name: str) -> Any:
        """Return the class of an interface."""
        return find_interface(self(name))

    def write(self, folder: str, **files: str) -> Path:
        """Write files of packages: `share_robot__msg__Wheel` for share_robot/msg/Wheel.msg."""
        for name, text in files.items():
            package, kind, word = self(name).split("__")
            file = self.root / folder / package / kind / f"{word}.{kind}"
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(self(text))
        return self.root / folder


@pytest.fixture
def own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Own]:
    """Packages of this test; no folder is searched yet, and no finder of files is installed."""
    finders = [each for each in sys.meta_path if not isinstance(each, FileFinder)]
    monkeypatch.setattr(sys, "meta_path", finders)
    with no_shares():
        yield Own(tmp_path)


def test_all_kinds_are_made(own: Own) -> None:
    """With constants, defaults, comments, and types of other packages, in another prefix and of callboard."""
    wheel_text = """\
# A wheel.
uint8 LEFT=1
std_msgs/Header header
float64 speed 2.5  # [m/s]
share_parts/Axle[] axles
"""
    here = own.write(
        "a",
        share_robot__msg__Wheel=wheel_text,
        share_robot__srv__Turn="Wheel wheel\n---\nbool ok\n",
        share_robot__action__Drive="int32 order\n---\nWheel[2] wheels\n---\nfloat32[] left\n",
    )
    there = own.write("b", share_parts__msg__Axle="float64 length 0.5\n")
    add_share_folders([here, there])
    wheel, axle = own.find("share_robot/Wheel"), own.find("share_parts/msg/Axle")
    assert (type_name(wheel), wheel.LEFT, wheel().speed) == (own("share_robot/msg/Wheel"), 1, 2.5)
    assert isinstance(wheel().header, Header)
    assert comments_of(wheel).fields["speed"] == "[m/s]"
    message = wheel(axles=[axle(length=3.0)])
    assert codec_for(wheel).decode(codec_for(wheel).encode(message)) == message
    assert repr(axle()) == own("share_parts.msg.Axle(length=0.5)")
    turn, drive = own.find("share_robot/srv/Turn"), own.find("share_robot/action/Drive")
    assert isinstance(turn.Request().wheel, wheel)
    assert [type(each) for each in drive.Result().wheels] == [wheel, wheel]
    assert own.find("share_robot/srv/Turn_Event") is turn.Event
    assert own.find("share_robot/msg/Wheel") is wheel
    assert interface_source(own("share_robot/srv/Turn")) == own("share_robot/Wheel wheel\n---\nbool ok\n")


def test_a_class_that_is_made_is_what_an_import_gives(own: Own, monkeypatch: pytest.MonkeyPatch) -> None:
    """Although files can be imported only after it was made: a program has one class of a type."""
    here = own.write(
        "a",
        share_robot__msg__Axle="float64 length\n",
        share_robot__msg__Wheel="Axle axle\n",
        share_robot__srv__Turn="Wheel wheel\n---\n",
    )
    add_share_folders([here])
    wheel, turn = own.find("share_robot/Wheel"), own.find("share_robot/srv/Turn")
    install_finder()
    monkeypatch.syspath_prepend(str(here))
    messages: Any = importlib.import_module(own("share_robot.msg"))
    services: Any = importlib.import_module(own("share_robot.srv"))
    assert messages.Wheel is own.find("share_robot/Wheel") is wheel
    assert messages.Axle is type(wheel().axle)
    assert services.Turn is turn
    assert {wheel.__module__, turn.__module__, turn.Request.__module__} == {
        own("share_robot.msg._wheel"),
        own("share_robot.srv._turn"),
    }


def test_an_import_gives_no_second_class_of_another_definition(
    own: Own, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It says which files differ."""
    here = own.write("a", share_robot__msg__Wheel="float64 speed\n")
    other = own.write("b", share_robot__msg__Wheel="float32 speed\n")
    add_share_folders([here])
    own.find("share_robot/Wheel")
    install_finder()
    monkeypatch.syspath_prepend(str(other))
    messages: Any = importlib.import_module(own("share_robot.msg"))
    with pytest.raises(ImportError, match=r"a/.*Wheel.msg defines it, and .*b/.*Wheel.msg differs"):
        messages.Wheel  # noqa: B018 - it is imported now


def test_packages_on_the_import_path_count(own: Own, monkeypatch: pytest.MonkeyPatch) -> None:
    """Generated ones, and those of files; with the same definition they have the same hash."""
    text = "float64[3] speeds\nstring<=5 name\n"
    share = own.write("share", share_robot__msg__Wheel=text, share_robot__msg__Axle=text)
    path = own.write("path", share_robot__msg__Wheel=text)
    generate(path / own("share_robot"))
    own.write("path", share_other__msg__Wheel="int32 a\n")
    own.write("share", share_other__msg__Wheel="int32 b\n", share_other__msg__Axle="int32 c\n")
    monkeypatch.syspath_prepend(path)
    add_share_folders([share])
    generated: Any = importlib.import_module(own("share_robot.msg"))
    assert own.find("share_robot/msg/Wheel") is generated.Wheel
    axle = own.find("share_robot/msg/Axle")
    assert type_hash(axle) != type_hash(generated.Wheel)
    fields = [each.get_fields_and_field_types() for each in (axle, generated.Wheel)]
    assert fields[0] == fields[1]
    install_finder()
    assert own.find("share_other/msg/Wheel").__module__ == own("share_other.msg._wheel")
    assert interface_source(own("share_other/msg/Wheel")) == "int32 a\n"
    other = own("share_other")
    assert source_file(other, "msg", "Wheel") == path / other / "msg" / "Wheel.msg"
    assert source_file(other, "msg", "Axle") == share / other / "msg" / "Axle.msg"


def test_ros_own_package_is_not_imported(own: Own, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its module has the name of the package, and classes that are no messages of callboard."""
    share = own.write("share", share_robot__msg__Wheel="share_parts/Axle axle\n", share_parts__msg__Axle="")
    for package in (own("share_robot"), own("share_parts")):
        (own.root / package / "msg").mkdir(parents=True)
        (own.root / package / "msg" / "__init__.py").write_text("raise SystemExit('imported')")
        (own.root / package / "__init__.py").write_text("")
    monkeypatch.syspath_prepend(own.root)
    add_share_folders([share])
    for name in ("share_robot/msg/Wheel", "share_parts/msg/Axle"):
        assert type_name(own.find(name)) == own(name)
    assert interfaces_of(own("share_parts")) == [own("share_parts/msg/Axle")]
    assert not {own("share_robot.msg"), own("share_parts.msg")} & sys.modules.keys()


def test_classes_of_the_program_are_used(own: Own) -> None:
    """A second class for one name would not match the program's; its name and module may be any."""

    class MyAxle(Message, type_name=own("share_robot/msg/Axle")):
        length: float = 0.5

    add_share_folders(
        [own.write("", share_robot__msg__Axle="int8 a\n", share_robot__msg__Wheel="Axle axle\n")]
    )
    assert own.find("share_robot/msg/Axle") is MyAxle
    assert isinstance(own.find("share_robot/msg/Wheel")().axle, MyAxle)


def test_packages_of_files_may_need_them(own: Own, monkeypatch: pytest.MonkeyPatch) -> None:
    """A package in a workspace contains types of installed ones, and those such of the workspace."""
    path = own.write("path", share_robot__msg__Wheel="share_parts/Axle axle\n", share_robot__msg__Rim="")
    share = own.write(
        "share", share_parts__msg__Axle="Hub hub\n", share_parts__msg__Hub="share_robot/Rim rim\n"
    )
    monkeypatch.syspath_prepend(path)
    add_share_folders([share])
    install_finder()
    wheel = own.find("share_robot/msg/Wheel")
    assert isinstance(wheel().axle, own.find("share_parts/msg/Axle"))
    assert isinstance(wheel().axle.hub.rim, own.find("share_robot/msg/Rim"))
    assert generate(path / own("share_robot"))  # whose text is for other computers, too
    assert (
        own("from share_parts.msg import Axle")
        in (path / own("share_robot") / "msg" / "_wheel.py").read_text()
    )


def test_callboards_types_remain(own: Own) -> None:
    """Whatever a prefix says of them; a type that a later ROS 2 has added to such a package is found."""
    add_share_folders(
        [own.write("", std_msgs__msg__String="int32 data\n", std_msgs__msg__SharedLater="String text\n")]
    )
    assert find_interface("std_msgs/msg/String") is String
    assert source_file("std_msgs", "msg", "String") is None
    later: Any = find_interface("std_msgs/msg/SharedLater")
    assert isinstance(later().text, String)
    names = interfaces_of("std_msgs")
    assert (names.count("std_msgs/msg/SharedLater"), names.count("std_msgs/msg/String")) == (1, 1)


def test_packages_and_types_are_listed(own: Own) -> None:
    """Without importing them; a .msg file comes before the .idl file that a build makes of it."""
    share = own.write("", share_robot__msg__Wheel="int32 a\n", share_robot__srv__Turn="---\n")
    messages = share / own("share_robot") / "msg"
    (messages / "Wheel.idl").write_text("module broken")
    idl = own("module share_robot { module msg { struct Axle { double length; }; }; };")
    (messages / "Axle.idl").write_text(idl)
    (messages / "notes.msg").write_text("no type")
    (share / own("share_none") / "launch").mkdir(parents=True)
    add_share_folders([share, share / "nowhere", share])
    assert share_folders == [share, share / "nowhere"]
    assert own("share_robot") in known_packages()
    assert own("share_none") not in known_packages()
    names = ["share_robot/msg/Axle", "share_robot/msg/Wheel", "share_robot/srv/Turn"]
    assert interfaces_of(own("share_robot")) == list(map(own, names))
    assert not [name for name in sys.modules if name.startswith(own(f"{SHARE_ROOT}.share_"))]
    assert interface_source(own("share_robot/msg/Axle")) == "float64 length\n"
    assert interface_source(own("share_robot/msg/Wheel")) == "int32 a\n"


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("int32 a\nint33 b\n", r"Wheel\.msg:2: "),
        ("Axle a\n", r"Wheel\.msg: .*Wheel contains share_robot/msg/Axle, and .*the package is not complete"),
        ("share_lacking/Axle axle\n", r"Wheel\.msg: .*contains share_lacking/msg/Axle, and no such type is"),
        (
            "share_lacking/Axle a\n",
            r"installed: install the package share_lacking, or add .* AMENT_PREFIX_PATH$",
        ),
        ("std_msgs/Strange text\n", r"contains std_msgs/msg/Strange, and .*install the package std_msgs"),
        ("Wheel[] wheels\n", r"contain one another: share_robot/msg/Wheel -> share_robot/msg/Wheel$"),
        (
            "Hub hub\n",
            r"Hub\.msg: Messages contain one another: share_robot/msg/Wheel -> share_robot/msg/Hub ->",
        ),
        ("Rim rim\n", r"Rim\.msg:1: "),
    ],
)
def test_a_wrong_file_is_named(own: Own, text: str, reason: str) -> None:
    """With its line, or with the package to install; the package's other types are not concerned."""
    share = own.write(
        "",
        share_robot__msg__Wheel=text,
        share_robot__msg__Hub="Wheel[2] wheels\n",
        share_robot__msg__Rim="int99 a\n",
        share_robot__msg__Good="int32 a\n",
    )
    add_share_folders([share])
    expected = own(rf"'share_robot/msg/Wheel' cannot be imported: .*{reason}")
    with pytest.raises(UnknownInterfaceError, match=expected):
        own.find("share_robot/msg/Wheel")
    assert installed_interface(own("share_robot/msg/Wheel")) is None
    assert type_name(own.find("share_robot/msg/Good")) == own("share_robot/msg/Good")


def test_deep_nesting_is_refused(own: Own) -> None:
    """64 levels are made, as in generated packages; 65 are not."""
    # A package for each: a folder with all files would be read for each of the pairs of levels.
    files = {f"share_deep{number}__msg__L": f"share_deep{number + 1}/L inner\n" for number in range(64)}
    add_share_folders([own.write("", **files, share_deep64__msg__L="int32 a\n")])
    with pytest.raises(UnknownInterfaceError, match=own("share_deep0/msg/L is nested more than 64 levels")):
        own.find("share_deep0/msg/L")
    assert type_name(own.find("share_deep1/msg/L")) == own("share_deep1/msg/L")


def test_a_type_that_is_contained_in_many_ways_is_checked_once(own: Own) -> None:
    """Each level doubles the ways, and not the work."""
    levels = [
        {
            f"share_{size}__msg__{side}{at}": f"A{at + 1} a\nB{at + 1} b\n"
            for at in range(size)
            for side in "AB"
        }
        | {f"share_{size}__msg__{side}{size}": "int32 x\n" for side in "AB"}
        for size in (4, 8)
    ]
    add_share_folders([own.write("", **levels[0], **levels[1])])
    few, many = (calls_of(partial(own.find, f"share_{size}/msg/A0")) for size in (4, 8))
    assert many < 8 * few  # without this, 16 times as many


def test_a_file_that_cannot_be_read_is_named(own: Own) -> None:
    """Its error is that of the type."""
    share = own.write("")
    (share / own("share_robot") / "msg" / "Wheel.msg").mkdir(parents=True)
    add_share_folders([share])
    with pytest.raises(UnknownInterfaceError, match=r"cannot be imported: .*Wheel\.msg"):
        own.find("share_robot/msg/Wheel")


def test_names_from_afar_lead_nowhere_else(own: Own) -> None:
    """A type name may come from another machine: only files below the folders are read for it."""
    share = own.write("share", share_robot__msg__Wheel="int32 a\n")
    add_share_folders([share / "share_other"])
    for name in ("../share_robot/msg/Wheel", "share_robot/msg/Wheel", "share_robot/../Wheel"):
        assert installed_interface(own(name)) is None
    assert source_file("..", "msg", "Wheel") is None
    with pytest.raises(UnknownInterfaceError, match=own("Unknown package 'share_robot'.*AMENT_PREFIX_PATH")):
        own.find("share_robot/msg/Wheel")
    for module in ("", ".share_robot", ".share_robot.msg"):
        importlib.import_module(own(f"{SHARE_ROOT}{module}"))
    for module in (".share_robot.msg._Wheel", ".share_robot.msg._Wheel.more", "d"):
        with pytest.raises(ImportError):
            importlib.import_module(own(f"{SHARE_ROOT}{module}"))
