"""`callboard interface`: definitions, prototypes, lists, generated classes."""

from __future__ import annotations

import asyncio
import io
import json
import sys
from typing import TYPE_CHECKING, Any, Final

import pytest

import actors
from actors.cli.main import main
from actors.cli.values import message_from_text, named_message
from actors.interfaces.registry import find_interface
from actors.interfaces.sensor_msgs.msg import BatteryState
from actors.tools.prefixes import use_ros_interfaces
from tests.actors.meeting import until
from tests.interfaces.shares import no_shares

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from tests.actors.cli.conftest import Desk


STRING: Final = "# One text.\n\nstring data  # Text in UTF-8.\n"


@pytest.fixture(autouse=True)
def _own_path(monkeypatch: pytest.MonkeyPatch) -> None:
    """What commands add to the import path is taken back."""
    monkeypatch.setattr(sys, "path", [*sys.path])
    monkeypatch.setattr(sys, "meta_path", [*sys.meta_path])


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("std_msgs/msg/String", STRING),
        ("std_msgs/String", STRING),
        ("example_interfaces/srv/AddTwoInts", "int64 a\nint64 b\n---\nint64 sum\n"),
    ],
)
def test_show_prints_the_definition(capsys: pytest.CaptureFixture[str], name: str, text: str) -> None:
    """As a .msg or .srv file has it."""
    assert main(["interface", "show", name]) == 0
    assert capsys.readouterr().out == text


def test_show_json_has_the_full_name(capsys: pytest.CaptureFixture[str]) -> None:
    """Also for a short one."""
    main(["interface", "show", "std_msgs/String", "--json"])
    document = json.loads(capsys.readouterr().out)
    assert document == {"name": "std_msgs/msg/String", "definition": STRING}


def test_show_knows_what_was_meant(capsys: pytest.CaptureFixture[str]) -> None:
    """A mistyped name fails with a suggestion."""
    assert main(["interface", "show", "std_msgs/msg/Strin"]) == 1
    assert capsys.readouterr().err == (
        "Interface 'msg/Strin' not found in package 'std_msgs'; did you mean std_msgs/msg/String?\n"
    )


def test_show_expands_what_is_contained(capsys: pytest.CaptureFixture[str]) -> None:
    """Below each field, indented with tabs."""
    assert main(["interface", "show", "std_msgs/msg/Header"]) == 0
    assert capsys.readouterr().out == (
        "# When and in which frame data was taken.\n\n"
        "builtin_interfaces/Time stamp  # Time that the data belongs to.\n\tint32 sec\n\tuint32 nanosec\n"
        "string frame_id  # Name of the coordinate frame of the data.\n"
    )


@pytest.fixture
def wheels(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """A package of text with comments in the current directory, not generated."""
    (tmp_path / "cli_wheels" / "msg").mkdir(parents=True)
    (tmp_path / "cli_wheels" / "msg" / "Wheel.msg").write_text("# round\nfloat64 speed # m/s\n")
    (tmp_path / "cli_wheels" / "msg" / "Axle.msg").write_text("# two\n\nWheel left\n")
    monkeypatch.chdir(tmp_path)
    yield
    for name in [name for name in sys.modules if name.startswith("cli_wheels")]:
        del sys.modules[name]


@pytest.mark.usefixtures("wheels")
@pytest.mark.parametrize(
    ("options", "out"),
    [
        ([], "# two\n\nWheel left\n\tfloat64 speed\n"),
        (["--all-comments"], "# two\n\nWheel left\n\t# round\n\tfloat64 speed # m/s\n"),
        (["--no-comments"], "Wheel left\n\tfloat64 speed\n"),
    ],
)
def test_show_with_comments(capsys: pytest.CaptureFixture[str], options: list[str], out: str) -> None:
    """Of the interface itself, of all, or none."""
    assert main(["interface", "show", "cli_wheels/Axle", *options]) == 0
    assert capsys.readouterr().out == out


@pytest.mark.usefixtures("wheels")
def test_packages_of_the_current_directory_are_listed(capsys: pytest.CaptureFixture[str]) -> None:
    """Also such as are only text."""
    main(["interface", "packages", "-m", "--json"])
    assert "cli_wheels" in json.loads(capsys.readouterr().out)
    main(["interface", "packages", "-s"])
    services = capsys.readouterr().out.split()
    assert "std_srvs" in services
    assert "cli_wheels" not in services
    main(["interface", "list", "-m"])
    assert "    cli_wheels/msg/Axle\n    cli_wheels/msg/Wheel\n" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("text", "code", "out", "err"),
    [
        ("std_msgs/msg/String\nstd_msgs/msg/Bool\n", 0, STRING, ""),
        ("\n", 2, "", "stdin names no type\n"),
    ],
)
def test_show_reads_the_type_from_a_pipe(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    text: str,
    code: int,
    out: str,
    err: str,
) -> None:
    """The first line counts."""
    monkeypatch.setattr(sys, "stdin", io.StringIO(text))
    assert main(["interface", "show", "-"]) == code
    assert capsys.readouterr() == (out, err)


def test_show_without_stdin(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """One line says that there is nothing to read: the shell has closed it, or it is not text."""
    monkeypatch.setattr(sys, "stdin", None)
    assert main(["interface", "show", "-"]) == 1
    assert capsys.readouterr().err == "There is nothing to read from: stdin is closed\n"
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(b"\xff\n"), encoding="utf-8"))
    assert main(["interface", "show", "-"]) == 1
    assert capsys.readouterr().err.startswith("stdin is not text")


def test_show_reads_no_endless_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Whatever comes, it takes no more than a name can be."""
    endless = io.StringIO("x" * 100_000)
    monkeypatch.setattr(sys, "stdin", endless)
    assert main(["interface", "show", "-"]) == 1
    assert endless.tell() < 10_000
    assert len(capsys.readouterr().err) < 10_000


def test_show_does_not_wait_for_a_terminal(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """It says what - is for."""
    terminal = io.StringIO()
    monkeypatch.setattr(terminal, "isatty", lambda: True)
    monkeypatch.setattr(sys, "stdin", terminal)
    assert main(["interface", "show", "-"]) == 2
    assert "reads the type from a pipe" in capsys.readouterr().err


@pytest.mark.processes
async def test_show_of_what_only_a_node_knows(desk: Desk) -> None:
    """Not installed here: the broker has the definition. Other verbs know the type, too."""
    publisher = (
        "import actors, asyncio\n"
        "from actors.interfaces.message import Message\n"
        "class Wheel(Message, type_name='known_there/msg/Wheel'):\n"
        "    speed: float = 0.0\n"
        "class Axle(Message, type_name='known_there/msg/Axle'):\n"
        "    left: Wheel\n"
        "async def main():\n"
        f"    async with actors.Node('there', url='{desk.url}') as node:\n"
        "        node.create_publisher(Axle, 'axles')\n"
        "        await node.get_graph()\n"
        "        print('ready', flush=True)\n"
        "        await asyncio.Event().wait()\n"
        "asyncio.run(main())\n"
    )
    process = await asyncio.create_subprocess_exec(
        sys.executable, "-c", publisher, stdout=asyncio.subprocess.PIPE
    )
    try:
        assert process.stdout is not None
        assert await asyncio.wait_for(process.stdout.readline(), 50) == b"ready\n"
        ended = await desk.callboard("interface", "show", "known_there/msg/Axle")
        document = (await desk.callboard("interface", "show", "known_there/msg/Wheel", "--json")).json
        wheel = await desk.callboard("interface", "proto", "--json", "known_there/msg/Wheel")
        sent = await desk.callboard(
            *("topic", "pub", "-t", "1", "-w", "0", "/axles", "known_there/msg/Axle", "{left: {speed: 2}}")
        )
    finally:
        process.kill()
        await process.wait()
    assert ended == (0, "known_there/Wheel left\n\tfloat64 speed\n", "")
    assert document == {"name": "known_there/msg/Wheel", "definition": "float64 speed\n"}
    assert wheel.json == {"speed": 0.0}
    assert (sent.code, sent.err) == (0, "")
    assert "speed=2.0" in sent.out


@pytest.mark.parametrize("url", ["callboard+unix:///nowhere/at/all", ""])
async def test_show_of_what_nobody_knows(desk: Desk, capsys: pytest.CaptureFixture[str], url: str) -> None:
    """The same text whether a broker answers or not."""
    arguments = ["interface", "show", "only_there/msg/Axle", "--url", url or desk.url]
    assert await asyncio.to_thread(main, arguments) == 1
    assert capsys.readouterr() == ("", "Unknown package 'only_there'\n")


@pytest.mark.parametrize(
    ("arguments", "out"),
    [
        (["std_msgs/msg/String"], "\"data: ''\n\"\n"),
        (["std_msgs/msg/Header", "--no-quotes"], "stamp:\n  sec: 0\n  nanosec: 0\nframe_id: ''\n"),
        (["std_srvs/srv/SetBool", "--no-quotes"], "data: false\n"),
        (["example_interfaces/action/Fibonacci", "--json"], '{"order": 0}\n'),
    ],
)
def test_proto(capsys: pytest.CaptureFixture[str], arguments: list[str], out: str) -> None:
    """What is sent, with its defaults: a message, a request, a goal."""
    assert main(["interface", "proto", *arguments]) == 0
    assert capsys.readouterr().out == out


IDL: Final = """module cli_wheels { module msg {
  @verbatim (language="comment", text="All of them.")
  struct Car {
    @verbatim (language="comment", text="How fast") @unit (value="m/s") @default (value=1.5)
    double speed;
    cli_wheels::msg::Axle axles[2];
  };
}; };
"""


@pytest.mark.usefixtures("wheels")
def test_packages_of_files_need_no_generated_classes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """`proto`, and so all that make messages, know what `show` knows: files, IDL, and what they contain."""
    (tmp_path / "cli_wheels" / "msg" / "Car.idl").write_text(IDL)
    (tmp_path / "cli_wheels" / "srv").mkdir()
    (tmp_path / "cli_wheels" / "srv" / "Turn.srv").write_text("Car car\n---\n")
    assert main(["interface", "show", "cli_wheels/Car"]) == 0
    assert capsys.readouterr().out == (
        "# All of them.\n\nfloat64 speed 1.5  # How fast [m/s]\n"
        "cli_wheels/Axle[2] axles\n\tWheel left\n\t\tfloat64 speed\n"
    )
    assert main(["interface", "proto", "--no-quotes", "cli_wheels/srv/Turn"]) == 0
    axles = "  axles:\n" + 2 * "  - left:\n      speed: 0.0\n"
    assert capsys.readouterr().out == f"car:\n  speed: 1.5\n{axles}"
    message = message_from_text(
        named_message("cli_wheels/Car"), "{speed: 2, axles: [{left: {speed: 3}}, {}]}"
    )
    assert "speed=3.0" in repr(message)
    assert main(["interface", "package", "cli_wheels"]) == 0
    assert capsys.readouterr().out.split() == [
        f"cli_wheels/{name}" for name in ("msg/Axle", "msg/Car", "msg/Wheel", "srv/Turn")
    ]


@pytest.mark.usefixtures("wheels")
def test_a_broken_file_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """With its line."""
    (tmp_path / "cli_wheels" / "msg" / "Bus.idl").write_text("module cli_wheels { module msg {\nunion U;")
    for verb in ("show", "proto"):
        assert main(["interface", verb, "cli_wheels/msg/Bus"]) == 1
        assert "Bus.idl:2: 'union' has no meaning in ROS 2" in capsys.readouterr().err


def test_proto_can_be_published(capsys: pytest.CaptureFixture[str]) -> None:
    """What is printed is read back as the same message."""
    main(["interface", "proto", "--no-quotes", "sensor_msgs/msg/BatteryState"])
    assert message_from_text(BatteryState, capsys.readouterr().out) == BatteryState()


def test_list_is_by_kind(capsys: pytest.CaptureFixture[str]) -> None:
    """Messages, services and actions under their headings."""
    main(["interface", "list"])
    lines = capsys.readouterr().out.splitlines()
    messages, services, actions = map(lines.index, ("Messages:", "Services:", "Actions:"))
    assert messages < lines.index("    std_msgs/msg/String") < services
    assert services < lines.index("    std_srvs/srv/Trigger") < actions


def test_package_lists_its_types(capsys: pytest.CaptureFixture[str]) -> None:
    """One a line, or as a JSON array."""
    main(["interface", "package", "std_srvs"])
    names = capsys.readouterr().out.split()
    assert names == [f"std_srvs/srv/{name}" for name in ("Empty", "SetBool", "Trigger")]
    main(["interface", "package", "std_srvs", "--json"])
    assert json.loads(capsys.readouterr().out) == names
    main(["interface", "package", "-s", "lifecycle_msgs"])
    services = capsys.readouterr().out.split()
    assert services
    assert all("/srv/" in name for name in services)


def test_unknown_package(capsys: pytest.CaptureFixture[str]) -> None:
    """ROS 2's text, with what may have been meant."""
    assert main(["interface", "package", "std_srv"]) == 1
    assert capsys.readouterr() == ("", "Unknown package 'std_srv'; did you mean std_srvs?\n")


@pytest.mark.processes
def test_generated_classes_are_found_from_their_directory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Generate prints what it wrote; the other verbs then know the package."""
    source = tmp_path / "src" / "cli_test_interfaces" / "msg"
    source.mkdir(parents=True)
    (source / "Wheel.msg").write_text("float64 speed\n")
    assert main(["interface", "generate", str(source.parent), "--output", str(tmp_path), "--json"]) == 0
    package = tmp_path / "cli_test_interfaces"
    assert str(package / "msg" / "_wheel.py") in json.loads(capsys.readouterr().out)
    monkeypatch.chdir(tmp_path)
    assert main(["interface", "show", "cli_test_interfaces/msg/Wheel"]) == 0
    assert capsys.readouterr().out == "float64 speed\n"


def test_generate_names_file_and_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A bad definition fails in one line."""
    source = tmp_path / "wheels" / "msg"
    source.mkdir(parents=True)
    (source / "Wheel.msg").write_text("float64 speed\nnonsense!\n")
    assert main(["interface", "generate", str(source.parent)]) == 1
    captured = capsys.readouterr()
    assert "Wheel.msg:2: " in captured.err
    assert captured.err.count("\n") == 1


def _wheels(folder: Path, name: str, text: str = "float64 speed\n") -> Path:
    source = folder / name / "msg"
    source.mkdir(parents=True)
    (source / "Wheel.msg").write_text(text)
    return source.parent


@pytest.mark.parametrize(
    ("own", "place", "reason"),
    [
        ("x = 1\nx.y\n", "__init__.py:2: ", "AttributeError: "),
        ("x = (\n", "__init__.py:1: ", "SyntaxError: "),
        ("import sys\nsys.exit(3)\n", ": ", "Python has ended with 3"),
        ("raise ImportError('no')\n", "__init__.py:1: ", "ImportError: no"),
    ],
)
@pytest.mark.processes
def test_generate_imports_what_it_has_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], own: str, place: str, reason: str
) -> None:
    """Case 84: in another process, with the author's own `__init__.py`; the error has its line."""
    source = _wheels(tmp_path, "cli_import_wheels")
    (source / "__init__.py").write_text(own)
    assert main(["interface", "generate", str(source)]) == 1
    error = capsys.readouterr().err
    assert f"cannot be imported: {reason}" in error
    assert place in error
    assert "cli_import_wheels" not in sys.modules


@pytest.mark.processes
def test_generate_refuses_a_package_that_python_has(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Case 84: ROS allows its name, but nobody could import it."""
    assert main(["interface", "generate", str(_wheels(tmp_path, "json"))]) == 1
    assert "No module named 'json.msg'" in capsys.readouterr().err


@pytest.mark.processes
def test_generate_names_packages_that_are_missing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """They may be generated afterwards."""
    source = _wheels(tmp_path, "cli_needing", "cli_needed_wheels/Wheel wheel\n")
    assert main(["interface", "generate", str(source)]) == 0
    assert "cli_needing needs other packages" in capsys.readouterr().err
    assert main(["interface", "generate", str(_wheels(tmp_path, "cli_needed_wheels"))]) == 0
    assert main(["interface", "generate", str(source)]) == 0
    assert not capsys.readouterr().err


def test_generate_wants_a_directory(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A missing one is named."""
    assert main(["interface", "generate", str(tmp_path / "no")]) == 1
    assert capsys.readouterr().err == f"No directory '{tmp_path / 'no'}'\n"


@pytest.mark.usefixtures("wheels")
def test_proto_of_what_no_memory_holds(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """An error, and no attempt."""
    for name, text in {"B": "C[10000] c", "C": "D[10000] d", "D": "int32 x"}.items():
        (tmp_path / "cli_wheels" / "msg" / f"{name}.msg").write_text(text)
    assert main(["interface", "proto", "cli_wheels/B"]) == 1
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.startswith("A new cli_wheels/msg/B would take ")


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A prefix of ROS 2 in AMENT_PREFIX_PATH, with a package that callboard does not have."""
    files = {
        "msg/Wheel.msg": "# A wheel.\nstring name\nAxle axle\n",
        "msg/Axle.msg": "float64 length 2.5\n",
        "srv/Turn.srv": "Axle axle\n---\nbool ok\n",
    }
    for name, text in files.items():
        file = tmp_path / "ros" / "share" / "cli_installed" / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
    monkeypatch.setenv("AMENT_PREFIX_PATH", f"/none:{tmp_path / 'ros'}")
    with no_shares():
        yield tmp_path / "ros" / "share" / "cli_installed"


def test_packages_of_ros_2_are_listed_and_shown(installed: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Those of AMENT_PREFIX_PATH, from their files."""
    assert main(["interface", "list", "-m", "--json"]) == 0
    names = json.loads(capsys.readouterr().out)
    assert {"cli_installed/msg/Wheel", "cli_installed/msg/Axle", "std_msgs/msg/String"} <= set(names)
    assert main(["interface", "packages", "-s"]) == 0
    assert "cli_installed\n" in capsys.readouterr().out
    assert main(["interface", "package", "cli_installed"]) == 0
    assert capsys.readouterr().out.split() == [
        "cli_installed/msg/Axle",
        "cli_installed/msg/Wheel",
        "cli_installed/srv/Turn",
    ]
    assert main(["interface", "show", "cli_installed/Wheel"]) == 0
    assert capsys.readouterr().out == "# A wheel.\nstring name\nAxle axle\n\tfloat64 length 2.5\n"
    assert main(["interface", "proto", "--no-quotes", "cli_installed/srv/Turn"]) == 0
    assert capsys.readouterr().out == "axle:\n  length: 2.5\n"
    (installed / "msg" / "Strange.msg").write_text("strange_installed/Thing thing\n")
    assert main(["interface", "proto", "cli_installed/msg/Strange"]) == 1
    assert (
        "Strange.msg: cli_installed/msg/Strange contains strange_installed/msg/Thing, and no such type"
        in (capsys.readouterr().err)
    )


@pytest.mark.usefixtures("installed")
async def test_types_of_ros_2_are_published_and_printed(desk: Desk) -> None:
    """By their names; programs find the same classes."""
    use_ros_interfaces()
    wheel: Any = find_interface("cli_installed/msg/Wheel")
    qos = actors.QoSProfile(depth=1, durability=actors.DurabilityPolicy.TRANSIENT_LOCAL)
    arguments = ("/wheels", "cli_installed/msg/Wheel")
    async with desk.node() as node:
        got: list[Any] = []
        node.create_subscription(wheel, "/turned", got.append)
        node.create_publisher(wheel, "/wheels", qos).publish(wheel(name="left"))
        await node.get_graph()
        ended = await desk.callboard("topic", "echo", *arguments, "--once", "--timeout", "20")
        assert ended == (0, "name: left\naxle:\n  length: 2.5\n---\n", "")
        ended = await desk.callboard(
            "topic", "pub", "/turned", arguments[1], "{name: right}", "--once", "-w", "1"
        )
        assert ended.code == 0
        await until(lambda: got == [wheel(name="right")])
