"""`callboard param`: list, get, set, describe, delete, dump, load."""

from __future__ import annotations

import asyncio
import math
from contextlib import asynccontextmanager
from typing import TYPE_CHECKING, Any

import pytest

from actors import (
    FloatingPointRange,
    IntegerRange,
    Parameter,
    ParameterDescriptor,
    ParameterType,
    SetParametersResult,
)
from actors.cli.commands.param.set import add_arguments
from actors.cli.completion import Offer, offers
from actors.cli.parsing import Parser
from actors.interfaces.rcl_interfaces.srv import GetParameters, ListParameters
from tests.seams.limits import set_limits

if TYPE_CHECKING:
    from collections.abc import AsyncIterator
    from pathlib import Path

    import actors
    from tests.actors.cli.conftest import Desk

ALWAYS = "start_type_description_service", "use_sim_time"


@asynccontextmanager
async def driver(desk: Desk, name: str = "driver", **options: Any) -> AsyncIterator[actors.Node]:
    async with desk.node(name, start_parameter_services=True, **options) as node:
        node.declare_parameters("", [("speed", 1.5), ("arm.joints", [1, 2]), ("frame", "base")])
        node.declare_parameter("extra", 1, ParameterDescriptor(dynamic_typing=True))
        node.declare_parameter("typed", ParameterType.INTEGER)
        await node.get_graph()
        yield node


async def test_list_all(desk: Desk) -> None:
    """A heading for each node, names sorted; hidden nodes and nodes without services left out."""
    async with (
        desk.node("b", start_parameter_services=True) as node,
        desk.node("_a", start_parameter_services=True) as hidden,
        desk.node("silent") as silent,
    ):
        for each in (node, hidden, silent):
            await each.get_graph()
        lines = "".join(f"  {name}\n" for name in ALWAYS)
        assert await desk.callboard("param", "list") == (0, f"/b:\n{lines}", "")
        both = await desk.callboard("param", "list", "--include-hidden-nodes")
        assert both.out == f"/_a:\n{lines}/b:\n{lines}"
        parameters = [{"name": name} for name in ALWAYS]
        assert (await desk.callboard("param", "list", "--json")).json == [
            {"node": "/b", "parameters": parameters}
        ]


async def test_list_one(desk: Desk) -> None:
    """No heading; prefixes, a filter and types; an unknown node is an error."""
    async with driver(desk):
        names = sorted(["arm.joints", "extra", "frame", "speed", "typed", *ALWAYS])
        whole = await desk.callboard("param", "list", "/driver")
        assert whole == (0, "".join(f"  {name}\n" for name in names), "")
        typed = await desk.callboard("param", "list", "driver", "--param-type", "--filter", "^s.*d$")
        assert typed == (0, "  speed (type: double)\n", "")
        # As ROS 2 does, from the beginning of a name; and no heading of a node without a match.
        assert await desk.callboard("param", "list", "--filter", "peed") == (0, "", "")
        assert (await desk.callboard("param", "list", "--filter", "spee")).out == "/driver:\n  speed\n"
        below = await desk.callboard("param", "list", "/driver", "--param-prefixes", "arm")
        assert below == (0, "  arm.joints\n", "")
        unknown = await desk.callboard("param", "list", "/drivr")
        assert (unknown.code, unknown.err[:14]) == (1, "Node not found")
        assert "did you mean '/driver'" in unknown.err
        assert (await desk.callboard("param", "list", "--filter", "(")).code == 2


async def test_one_node_that_fails_does_not_hide_the_others(desk: Desk) -> None:
    """The others are printed, the failure is named, and the exit code is 1."""

    def fail(request: ListParameters.Request) -> ListParameters.Response:
        raise OSError("broken")

    async with driver(desk), desk.node("bad") as bad:
        bad.create_service(ListParameters, "~/list_parameters", fail)
        await bad.get_graph()
        code, out, err = await desk.callboard("param", "list")
        assert (code, out.splitlines()[0]) == (1, "/driver:")
        assert err == (
            "Exception while calling service of node '/bad':"
            " Service '/bad/list_parameters' failed: OSError: broken\n"
        )


@pytest.mark.parametrize(
    ("value", "out"),
    [
        (True, "Boolean value is: True"),
        (42, "Integer value is: 42"),
        (0.5, "Double value is: 0.5"),
        ("text", "String value is: text"),
        (b"\x01\xff", "Byte values are: [1, 255]"),
        ([True], "Boolean values are: [True]"),
        ([1, 2], "Integer values are: [1, 2]"),
        ([0.5], "Double values are: [0.5]"),
        (["a", "b"], "String values are: ['a', 'b']"),
    ],
)
async def test_get(desk: Desk, value: Any, out: str) -> None:
    """`param get` prints the type and the value."""
    async with driver(desk) as node:
        node.declare_parameter("p", value)
        assert await desk.callboard("param", "get", "/driver", "p") == (0, f"{out}\n", "")
        shown = out.partition(": ")[2]
        assert (await desk.callboard("param", "get", "/driver", "p", "--hide-type")).out == f"{shown}\n"
        found = (await desk.callboard("param", "get", "/driver", "p", "--json")).json
        assert found["value"] == ([*value] if isinstance(value, bytes) else value)


async def test_get_what_is_not_set(desk: Desk) -> None:
    """Exit code 1, with a suggestion for a misspelt name."""
    async with driver(desk):
        assert await desk.callboard("param", "get", "/driver", "typed") == (1, "", "Parameter not set\n")
        code, _, err = await desk.callboard("param", "get", "/driver", "sped")
        assert (code, err) == (1, "Parameter not set; did you mean 'speed'?\n")


async def test_set(desk: Desk) -> None:
    """The value's type is YAML's; the reason of a failure is on stderr, and the exit code 1."""
    async with driver(desk) as node:
        done = await desk.callboard("param", "set", "/driver", "speed", "2.5")
        assert done == (0, "Set parameter successful\n", "")
        assert node.get_parameter("speed").value == 2.5
        failed = await desk.callboard("param", "set", "/driver", "speed", "fast")
        reason = "Wrong parameter type, expected DOUBLE got STRING"
        assert failed == (1, "", f"Setting parameter failed: {reason}\n")
        as_json = await desk.callboard("param", "set", "/driver", "speed", "fast", "--json")
        assert (as_json.code, as_json.json) == (1, [{"name": "speed", "successful": False, "reason": reason}])
        text = "No value for the parameter 'speed'; write NAME VALUE [NAME VALUE …]\n"
        assert await desk.callboard("param", "set", "/driver", "speed") == (2, "", text)


async def test_set_numbers_below_zero_and_empty_texts(desk: Desk) -> None:
    """A minus sign begins no option; an empty word is an empty string."""
    async with driver(desk) as node:
        done = await desk.callboard("param", "set", "/driver", "speed", "-1.5", "frame", "")
        assert done.code == 0
        assert [each.value for each in node.get_parameters(["speed", "frame"])] == [-1.5, ""]


async def test_a_name_with_a_line_break_stays_in_its_line(desk: Desk) -> None:
    """A node chooses the names of its parameters; it cannot imitate another line."""
    async with desk.node("odd", start_parameter_services=True) as node:
        node.declare_parameter("a\n/fake:", 1)
        await node.get_graph()
        assert "  a\\n/fake:\n" in (await desk.callboard("param", "list", "/odd")).out
        described = await desk.callboard("param", "describe", "/odd", "a\n/fake:")
        assert described.out.startswith("Parameter name: a\\n/fake:\n  Type: ")


@pytest.mark.parametrize("value", ["-1.5e-3", "-x", "--atomic"])
def test_a_value_with_a_leading_dash(value: str) -> None:
    """After `--` it is no option."""
    parser = Parser()
    add_arguments(parser)
    assert parser.parse_args(["/driver", "p", "--", value]).pairs == ["p", value]


async def test_set_several(desk: Desk) -> None:
    """`param set` sets several parameters one by one, or with --atomic all or none."""
    async with driver(desk) as node:
        pairs = ("frame", "map", "speed", "fast")
        code, out, err = await desk.callboard("param", "set", "/driver", *pairs)
        assert (code, out) == (1, "frame: Set parameter successful\n")
        assert err.startswith("speed: Setting parameter failed: Wrong")
        code, out, err = await desk.callboard(
            "param", "set", "--atomic", "/driver", "frame", "odom", *pairs[2:]
        )
        assert (code, out, err[:38]) == (1, "", "Setting parameters atomically failed: ")
        assert node.get_parameter("frame").value == "map"
        good = await desk.callboard("param", "set", "--atomic", "/driver", "frame", "odom", "speed", "3.0")
        assert good == (0, "Set parameters atomically successful\n", "")


async def test_describe(desk: Desk) -> None:
    """`param describe` prints the texts of ROS 2."""
    async with driver(desk) as node:
        whole = IntegerRange(from_value=1, to_value=9, step=2)
        node.declare_parameter(
            "gear",
            3,
            ParameterDescriptor(description="which", additional_constraints="odd", integer_range=[whole]),
        )
        ended = await desk.callboard("param", "describe", "/driver", "gear", "use_sim_time", "none")
        assert (ended.code, ended.err) == (1, "Parameter not declared: none\n")
        assert ended.out == (
            "Parameter name: gear\n  Type: integer\n  Description: which\n  Constraints:\n"
            "    Min value: 1\n    Max value: 9\n    Step: 2\n    Additional constraints: odd\n"
            "Parameter name: use_sim_time\n  Type: boolean\n  Constraints:\n"
        )
        half = FloatingPointRange(from_value=0.0, to_value=1.0)
        node.declare_parameter("part", 0.5, ParameterDescriptor(read_only=True, floating_point_range=[half]))
        (found,) = (await desk.callboard("param", "describe", "/driver", "part", "--json")).json
        assert found["range"] == {"from_value": 0.0, "to_value": 1.0, "step": 0.0}
        assert (found["type"], found["read_only"]) == ("double", True)
        assert "    Read only: true\n" in (await desk.callboard("param", "describe", "/driver", "part")).out


async def test_delete(desk: Desk) -> None:
    """Only a parameter of a dynamic type can be deleted."""
    async with driver(desk) as node:
        done = await desk.callboard("param", "delete", "/driver", "extra")
        assert done == (0, "Deleted parameter successfully\n", "")
        assert not node.has_parameter("extra")
        failed = await desk.callboard("param", "delete", "/driver", "speed")
        assert failed == (1, "", "Deleting parameter failed: Static parameter cannot be undeclared\n")
        document = (await desk.callboard("param", "delete", "/driver", "speed", "--json")).json
        assert (document["name"], document["successful"]) == ("speed", False)


async def test_dump(desk: Desk) -> None:
    """YAML, sorted, dotted names nested, nothing without a value."""
    async with driver(desk):
        code, out, err = await desk.callboard("param", "dump", "/driver")
    assert (code, err) == (0, "")
    assert out == (
        "/driver:\n  ros__parameters:\n    arm:\n      joints:\n      - 1\n      - 2\n    extra: 1\n"
        "    frame: base\n    speed: 1.5\n"
        "    start_type_description_service: false\n    use_sim_time: false\n\n"
    )


async def test_a_dump_can_be_loaded(desk: Desk, tmp_path: Path) -> None:
    """Every value comes back, also strings that look like something else and names that continue others."""
    texts = [
        "1",
        "1e5",
        "1.5",
        "yes",
        "no",
        "null",
        "~",
        "",
        " ",
        "0x10",
        "1_0",
        "a: b",
        "- x",
        "é\n",
        "2020-01-01",
    ]
    async with driver(desk, namespace="ns") as node:
        node.declare_parameter("texts", texts)
        for number, text in enumerate(texts):
            node.declare_parameter(f"text.number{number}", text)
        node.declare_parameters("", [("speed.limit", 5), ("flags", [True]), ("tiny", 1e-7), ("huge", 1e300)])
        node.declare_parameters("", [("raw", b"\0\xff"), ("none", ParameterType.STRING_ARRAY)])
        node.set_parameters([Parameter("none", value=[])])
        names = sorted({*node.list_parameters([], 0).names} - {"typed"})
        before = node.get_parameters(names)
        file = tmp_path / "dump.yaml"
        file.write_text((await desk.callboard("param", "dump", "/ns/driver")).out, encoding="utf-8")
        as_json = (await desk.callboard("param", "dump", "/ns/driver", "--json")).json
        assert as_json["/ns/driver"]["ros__parameters"]["raw"] == [0, 255]
        others: dict[ParameterType, Any] = {
            ParameterType.STRING: "other",
            ParameterType.BYTE_ARRAY: b"x",
            ParameterType.STRING_ARRAY: ["x"],
        }
        for each in before:
            if each.type_ in others:
                node.set_parameters([Parameter(each.name, value=others[each.type_])])
        ended = await desk.callboard("param", "load", "/ns/driver", str(file))
        assert "Set parameter frame successful\n" in ended.out
        assert ended.err == (
            "Set parameter start_type_description_service failed:"
            " Trying to set a read-only parameter: start_type_description_service.\n"
        )
        assert node.get_parameters(names) == before


async def test_a_dump_of_empty_lists_can_be_loaded(desk: Desk, tmp_path: Path) -> None:
    """Each keeps its type, that of bytes, too."""
    kinds = [kind for kind in ParameterType if kind >= ParameterType.BYTE_ARRAY]
    async with driver(desk, namespace="ns") as node:
        for kind in kinds:
            node.declare_parameter(kind.name, Parameter(kind.name, kind, []).value or kind)
            node.set_parameters([Parameter(kind.name, kind, [])])
        file = tmp_path / "dump.yaml"
        file.write_text((await desk.callboard("param", "dump", "/ns/driver")).out, encoding="utf-8")
        assert file.read_text(encoding="utf-8").count(": []\n") == len(kinds)
        done = await desk.callboard("param", "load", "/ns/driver", str(file))
        assert done.out.count(" successful") >= len(kinds)
        found = node.get_parameters([kind.name for kind in kinds])
        assert [each.type_ for each in found] == kinds
        assert not any(each.value for each in found)


async def test_a_dump_as_json_can_be_loaded(desk: Desk, tmp_path: Path) -> None:
    """NaN, infinities, bytes, empty lists and 64-bit integers come back, with the types of the parameters."""
    values: dict[str, Any] = {
        "nan": math.nan,
        "infinite": -math.inf,
        "numbers": [0.5, math.nan, math.inf],
        "all_nan": [math.nan],
        "raw": b"\0\xff",
        "no_bytes": b"",
        "limits": [-(2**63), 2**63 - 1],
        "text": "nan",
        "texts": ["1e3", "\U0001f9be", "\x7f\0", "inf"],
        "a.b": 1,
        "a.b.c": True,
    }
    empty = {f"empty_{kind.name.lower()}": kind for kind in ParameterType if kind > ParameterType.BYTE_ARRAY}
    others: dict[type, Any] = {float: 1.0, bytes: b"x", int: 0, str: "", bool: False}
    async with driver(desk, namespace="ns") as node:
        for name, value in values.items():
            node.declare_parameter(name, value)
        for name, kind in empty.items():
            node.declare_parameter(name, Parameter(name, kind, []).value or kind)
            node.set_parameters([Parameter(name, kind, [])])
        names = [*values, *empty]
        before = node.get_parameters(names)
        file = tmp_path / "dump.json"
        file.write_text((await desk.callboard("param", "dump", "/ns/driver", "--json")).out, encoding="utf-8")
        for name, value in values.items():
            other = [others[type(value[0])]] if isinstance(value, list) else others[type(value)]
            assert all(each.successful for each in node.set_parameters([Parameter(name, value=other)]))
        for arguments in ((), ("--no-use-wildcard", "--json")):
            await desk.callboard("param", "load", "/ns/driver", str(file), *arguments)
            after = node.get_parameters(names)
            assert [repr(each.value) for each in after] == [repr(each.value) for each in before]
            assert [each.type_ for each in after] == [each.type_ for each in before]
        file.write_text('{"/ns/driver": {"ros__parameters": {"text": null}}}', encoding="utf-8")
        assert (await desk.callboard("param", "load", "/ns/driver", str(file))).code == 1
        file.write_text('{"/ns/driver": {"ros__parameters": {"text": [1, "a"]}}}', encoding="utf-8")
        assert (await desk.callboard("param", "load", "/ns/driver", str(file))).code == 1


async def test_load(desk: Desk, tmp_path: Path) -> None:
    """Wildcards count unless they are not wanted; a file without anything for the node is an error."""
    file = tmp_path / "some.yaml"
    file.write_text("/**: {ros__parameters: {frame: map}}\n")
    async with driver(desk) as node:
        ended = await desk.callboard("param", "load", "/driver", str(file), "--json")
        assert ended.json == [{"name": "frame", "successful": True, "reason": ""}]
        assert node.get_parameter("frame").value == "map"
        code, _, err = await desk.callboard("param", "load", "/driver", str(file), "--no-use-wildcard")
        assert (code, "no parameters of /driver" in err) == (1, True)


async def test_a_node_without_services(desk: Desk) -> None:
    """It is there, but does not serve its parameters: an error at once that says why."""
    async with desk.node("silent") as node:
        await node.get_graph()
        code, _, err = await desk.callboard("param", "get", "/silent", "a")
        assert code == 1
        assert err.startswith("Node '/silent' has no parameters: it does not serve them (start_parameter_")


async def test_a_node_that_does_not_answer(desk: Desk) -> None:
    """The command ends at its timeout, with 124."""

    async def never(request: GetParameters.Request) -> GetParameters.Response:
        await asyncio.Event().wait()
        return GetParameters.Response()

    async with desk.node("frozen") as node:
        node.create_service(GetParameters, "~/get_parameters", never)
        await node.get_graph()
        code, _, err = await desk.callboard("param", "get", "/frozen", "a", "--timeout", "2")
        assert (code, err) == (124, "Node '/frozen' has not answered within 2 s\n")


async def test_a_node_that_is_yet_to_come(desk: Desk) -> None:
    """With --timeout a command waits for it; if it does not appear, it ends with ROS 2's text and 124."""
    async with desk.node("watch") as watch:
        getting = desk.start("param", "get", "/driver", "speed", "--hide-type", "--timeout", "20")
        while not any("_callboard_cli" in name for name in (await watch.get_graph()).nodes()):
            assert not getting.done()
        async with driver(desk):
            assert await getting == (0, "1.5\n", "")
            code, _, err = await desk.callboard("param", "get", "/drivr", "speed", "--timeout", "2")
            assert (code, err) == (124, "Node not found: '/drivr'; did you mean '/driver'?\n")


async def test_a_callback_that_raises(desk: Desk) -> None:
    """If the node's callback raises, the error is printed and the exit code is 1."""
    async with driver(desk) as node:

        def boom(parameters: list[Parameter]) -> SetParametersResult:
            raise OSError("no disk")

        node.add_on_set_parameters_callback(boom)
        ended = await desk.callboard("param", "set", "/driver", "speed", "2.0")
        assert ended == (1, "", "Node '/driver' failed: OSError: no disk\n")


async def test_names_are_completed(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nodes, then the parameters of the node; of `param set` each second word."""
    set_limits(monkeypatch, completion_broker_sec=20.0, completion_parameters_sec=3.0)
    place = ("--url", desk.url)
    async with driver(desk):

        def ask() -> None:
            assert offers(["param", "get", *place, "/dr"]) == [Offer("/driver")]
            assert offers(["param", "get", *place, "/driver", "sp"]) == [Offer("speed")]
            assert offers(["param", "describe", *place, "/driver", "speed", "fr"]) == [Offer("frame")]
            assert offers(["param", "set", *place, "/driver", "speed", ""]) == []
            assert offers(["param", "set", *place, "/driver", "speed", "1.0", "fr"]) == [Offer("frame")]
            assert offers(["param", "get", *place, "/nobody", ""]) == []

        await asyncio.to_thread(ask)
