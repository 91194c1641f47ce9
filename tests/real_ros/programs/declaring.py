"""Parameters of a node: declared, set, described."""

from __future__ import annotations

import array
import warnings

import numpy as np
from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    ParameterType,
    SetParametersResult,
)
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient

from tests.real_ros.programs.errors import outcome
from tests.real_ros.programs.running import running_node, spin_until

VALUES = (
    *(
        True,
        0,
        1,
        -(2**63),
        1.5,
        float("inf"),
        "",
        "text",
        None,
        [],
        (),
        [1],
        [1.5],
        [1, 2.5],
        ["a"],
        ["a", 1],
        [None],
    ),
    *(
        [[1]],
        [b"\x01", b"\x02"],
        {"a": 1},
        {1},
        range(3),
        object,
        1j,
        np.float64(1.5),
        np.int32(7),
        np.bool_(True),
    ),
    *(
        np.array([1, 2]),
        np.array([1.5]),
        np.array([True]),
        np.array([]),
        array.array("i", [1]),
        array.array("d", [1.5]),
    ),
    array.array("B", [1]),
)
ODD_VALUES = (2**63, b"\x01", bytearray(b"a"), [True, 1])
"""Values that rclpy takes or refuses by accident."""


def _plain(parameter):
    value = parameter.value
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, bytes | bytearray):  # see `byte_array_of_message`
        value = [bytes((each,)) for each in value]
    if isinstance(value, list | tuple):
        value = [each.hex() if isinstance(each, bytes) else each for each in value]
    return [parameter.type_.name, value]


def _result(result):
    """Return whether something succeeded, and whether it says why not."""
    return [result.successful, bool(result.reason)]


def types_of_values():
    """Say of which type parameters with values are."""
    return [outcome(lambda: _plain(Parameter("a", value=value))) for value in VALUES]  # noqa: B023


def values_of_types():
    """Make parameters of a type and a value."""
    return [
        [outcome(lambda: _plain(Parameter("a", kind, value))) for kind in Parameter.Type]  # noqa: B023
        for value in VALUES
        if value is not True  # see `odd_values`
    ]


def odd_values():
    """Make parameters of odd values."""
    found = [outcome(lambda: _plain(Parameter("a", value=value))) for value in ODD_VALUES]  # noqa: B023
    return [*found, outcome(lambda: _plain(Parameter("a", Parameter.Type.INTEGER, True)))]


def types_as_messages():
    """Convert parameters to messages and back."""

    def there_and_back(value):
        message = Parameter("a", value=value).to_parameter_msg()
        return [message.value.type, _plain(Parameter.from_parameter_msg(message))]

    return [outcome(there_and_back, value) for value in VALUES]


def byte_array_of_message():
    """Read a byte array from a message."""
    value = Parameter.from_parameter_msg(Parameter("a", value=[b"\x01", b"\x02"]).to_parameter_msg()).value
    return [type(each).__name__ for each in value]


def declared():
    """Declare a parameter with each value."""

    def declare(value):
        with running_node() as node:
            return _plain(node.declare_parameter("a", value))

    return [outcome(declare, value) for value in VALUES]


def set_to_each():
    """Set parameters of several types to each value."""
    with running_node() as node:
        for name, value in (("i", 1), ("d", 1.5), ("s", "x"), ("l", [1]), ("n", [1.5])):
            node.declare_parameter(name, value)
        node.declare_parameter("any", 1, ParameterDescriptor(dynamic_typing=True))

        def set_to(name, value):
            return [
                *_result(node.set_parameters([Parameter(name, value=value)])[0]),
                _plain(node.get_parameter(name)),
            ]

        return {
            name: [outcome(set_to, name, value) for value in (1, 2.5, "y", True, [2], [2.5], None)]
            for name in ("i", "d", "s", "l", "n", "any")
        }


def empty_lists():
    """Set lists to empty ones, and override them so."""
    with running_node("-p", "c:=[]") as node:
        node.declare_parameters("", [("a", [1]), ("b", ["x"]), ("c", [1.5])])
        results = node.set_parameters(
            [Parameter("a", value=[]), Parameter("b", Parameter.Type.STRING_ARRAY, [])]
        )
        return [[_result(each) for each in results], [_plain(node.get_parameter(name)) for name in "abc"]]


def declared_twice():
    """Declare a parameter again."""
    with running_node() as node:
        node.declare_parameter("a", 1)
        return outcome(node.declare_parameter, "a", 1)


def names():
    """Declare parameters of names that are odd."""
    with running_node() as node:
        odd = ("a.b", "", ".", "a b", "é", "a/b", "~", 1, None, "a" * 300, "a..b")
        return [outcome(lambda: _plain(node.declare_parameter(name, 1))) for name in odd]  # noqa: B023


def without_default():
    """Declare parameters with a type only, with neither, and with both."""
    with running_node("-p", "given:=1") as node:
        return [
            outcome(lambda: _plain(node.declare_parameter("a", Parameter.Type.INTEGER))),
            outcome(lambda: _plain(node.get_parameter("a"))),
            outcome(lambda: _plain(node.declare_parameter("b"))),
            outcome(lambda: _plain(node.declare_parameter("c", None))),
            outcome(lambda: _plain(node.declare_parameter("given", Parameter.Type.INTEGER))),
            outcome(
                lambda: _plain(node.declare_parameter("d", None, ParameterDescriptor(dynamic_typing=True)))
            ),
            outcome(lambda: _plain(node.get_parameter("d"))),
            outcome(lambda: _plain(node.get_parameter_or("d", Parameter("d", value=5)))),
            outcome(lambda: _plain(node.get_parameter_or("e", Parameter("e", value=5)))),
            outcome(lambda: _plain(node.get_parameter("e"))),
        ]


def overrides_of_another_type():
    """Override a parameter by a value of another type."""

    def declare(override, value):
        with running_node("-p", f"a:={override}") as node:
            return _plain(node.declare_parameter("a", value))

    overrides = ("1", "1.5", "x", "true", "[1]", "[1.5]", "''", "null")
    return [
        [outcome(declare, override, value) for value in (1, 1.5, "s", [1], [1.5], ["s"])]
        for override in overrides
    ]


def ignored_override():
    """Ignore an override."""
    with running_node("-p", "a:=1") as node:
        return _plain(node.declare_parameter("a", 2, ignore_override=True))


def read_only():
    """Set and undeclare a parameter that is read-only."""
    with running_node("-p", "a:=3") as node:
        node.declare_parameter("a", 1, ParameterDescriptor(read_only=True))
        return [
            _plain(node.get_parameter("a")),
            _result(node.set_parameters([Parameter("a", value=2)])[0]),
            outcome(node.undeclare_parameter, "a"),
            _plain(node.get_parameter("a")),
        ]


def ranges():
    """Set parameters within and outside of their ranges."""
    with running_node() as node:
        number = ParameterDescriptor(
            floating_point_range=[FloatingPointRange(from_value=-1.0, to_value=1.0, step=0.25)]
        )
        count = ParameterDescriptor(integer_range=[IntegerRange(from_value=0, to_value=10, step=4)])
        node.declare_parameter("d", 0.0, number)
        node.declare_parameter("i", 0, count)
        return [
            [
                _result(node.set_parameters([Parameter("d", value=v)])[0])
                for v in (-1.0, 0.25, 0.3, 1.0, 1.1, float("nan"))
            ],
            [_result(node.set_parameters([Parameter("i", value=v)])[0]) for v in (0, 4, 5, 8, 10, 11, -1)],
            outcome(node.declare_parameter, "e", 5.0, number),
            outcome(node.declare_parameter, "f", 3, count),
            _plain(node.declare_parameter("g", "text", count)),
        ]


def reasons():
    """Ask why values are refused."""
    with running_node() as node:
        number, count = FloatingPointRange(from_value=-1.0, to_value=1.0), IntegerRange(to_value=10, step=4)
        steps = FloatingPointRange(from_value=-1.0, to_value=1.0, step=0.25)
        node.declare_parameter("d", 0.0, ParameterDescriptor(floating_point_range=[number]))
        node.declare_parameter("e", 0.0, ParameterDescriptor(floating_point_range=[steps]))
        node.declare_parameter("i", 0, ParameterDescriptor(integer_range=[count]))
        node.declare_parameter("r", 0, ParameterDescriptor(read_only=True))
        node.declare_parameter("s", "text")
        values = {"d": 1.5, "e": 0.3, "i": 5, "r": 1, "s": None}
        refused = [Parameter(name, value=value) for name, value in values.items()]
        refused += [Parameter("d", value=float("nan")), Parameter("e", value=-2.0), Parameter("i", value=11)]
        reasons = [each.reason for each in node.set_parameters(refused)]
        return [reasons, node.set_parameters_atomically(refused[2:]).reason]


def reasons_for_types():
    """Ask why values of another type are refused."""
    with running_node() as node:
        node.declare_parameter("a", 1)
        return [node.set_parameters([Parameter("a", value=each)])[0].reason for each in ("text", 1.5, [1])]


def refusals_without_a_reason():
    """Refuse values in a callback without a reason."""
    with running_node() as node:
        node.declare_parameter("a", 1)
        node.add_on_set_parameters_callback(lambda _: SetParametersResult(successful=False))
        return node.set_parameters([Parameter("a", value=2)])[0].reason


def undeclared():
    """Use parameters that are not declared."""
    with running_node() as node:
        return [
            outcome(node.get_parameter, "a"),
            outcome(node.set_parameters, [Parameter("a", value=1)]),
            outcome(node.set_parameters_atomically, [Parameter("a", value=1)]),
            outcome(node.describe_parameter, "a"),
            outcome(node.undeclare_parameter, "a"),
            outcome(node.get_parameters, ["a"]),
            outcome(node.get_parameter_type, "a"),
            node.has_parameter("a"),
        ]


def undeclared_but_allowed():
    """Use parameters that are not declared in a node that allows it."""
    with running_node("-p", "given:=1", allow_undeclared_parameters=True) as node:
        return [
            outcome(lambda: _plain(node.get_parameter("a"))),
            outcome(lambda: _plain(node.get_parameter("given"))),
            [_result(each) for each in node.set_parameters([Parameter("a", value=1)])],
            _plain(node.get_parameter("a")),
            [_result(each) for each in node.set_parameters([Parameter("a", value="x")])],
            outcome(lambda: node.describe_parameter("b").name),
            [_plain(each) for each in node.get_parameters(["a", "b"])],
            [_result(each) for each in node.set_parameters([Parameter("a")])],
            node.has_parameter("a"),
        ]


def unset():
    """Delete parameters by setting them to nothing."""
    with running_node() as node:
        node.declare_parameter("a", 1)
        node.declare_parameter("b", 1, ParameterDescriptor(dynamic_typing=True))
        results = [_result(node.set_parameters([Parameter(name)])[0]) for name in ("a", "b")]
        return [results, node.has_parameter("a"), node.has_parameter("b")]


def several():
    """Declare and set several parameters."""
    with running_node() as node:
        found = node.declare_parameters(
            "motor", [("gain", 1.5), ("name", "left"), ("on", True, ParameterDescriptor())]
        )
        results = node.set_parameters(
            [Parameter("motor.gain", value="x"), Parameter("motor.name", value="right")]
        )
        atomic = node.set_parameters_atomically(
            [Parameter("motor.gain", value=2.5), Parameter("motor.name", value=1)]
        )
        return [
            [(each.name, _plain(each)) for each in found],
            [_result(each) for each in results],
            _result(atomic),
            {name: _plain(each) for name, each in node.get_parameters_by_prefix("motor").items()},
            {name: _plain(each) for name, each in node.get_parameters_by_prefix("mot").items()},
            outcome(lambda: len(node.declare_parameters("", [("x",), ("y", 1), ("y", 2)]))),
            outcome(node.declare_parameters, "", [("z", 1, 2, 3)]),
        ]


def callbacks():
    """Change, refuse and follow changes in callbacks."""
    with running_node() as node:
        node.declare_parameters("", [("a", 1), ("b", 1)])
        seen = []

        def change(parameters):
            return [*parameters, Parameter("b", value=parameters[0].value * 2)]

        def check(parameters):
            seen.append(["check", [(each.name, each.value) for each in parameters]])
            return SetParametersResult(successful=parameters[0].value < 10, reason="too large")

        node.add_pre_set_parameters_callback(change)
        node.add_on_set_parameters_callback(check)
        node.add_post_set_parameters_callback(
            lambda each: seen.append(["done", [(x.name, x.value) for x in each]])
        )
        results = [_result(node.set_parameters([Parameter("a", value=value)])[0]) for value in (3, 30)]
        return [results, seen, _plain(node.get_parameter("a")), _plain(node.get_parameter("b"))]


def refused_when_declared():
    """Refuse the first value in a callback."""
    with running_node() as node:
        node.add_on_set_parameters_callback(lambda _: SetParametersResult(successful=False, reason="no"))
        return [outcome(node.declare_parameter, "a", 1), node.has_parameter("a")]


def listed():
    """List parameters by prefix and depth."""
    with running_node() as node:
        node.declare_parameters("", [("a", 1), ("b.c", 1), ("b.d.e", 1), ("bx", 1)])
        queries = (
            ([], 0),
            ([], 1),
            ([], 2),
            (["b"], 0),
            (["b"], 1),
            (["b"], 2),
            (["b.d"], 1),
            (["a"], 1),
            (["x"], 0),
            (["b."], 0),
        )
        found = [node.list_parameters(prefixes, depth) for prefixes, depth in queries]
        return [[sorted(n for n in each.names if "_" not in n), sorted(each.prefixes)] for each in found]


def described():
    """Describe parameters."""
    with running_node() as node:
        node.declare_parameter(
            "a", 1, ParameterDescriptor(description="count", additional_constraints="even")
        )
        node.declare_parameter("b", 1.5)
        found = node.describe_parameters(["b", "a"])
        node.set_descriptor("b", ParameterDescriptor(type=ParameterType.PARAMETER_DOUBLE, description="new"))
        return [
            [
                (each.name, each.type, each.description, each.additional_constraints, each.read_only)
                for each in found
            ],
            node.describe_parameter("b").description,
            [int(each) for each in node.get_parameter_types(["a", "b"])],
        ]


def descriptor_without_type():
    """Replace a parameter's descriptor by one that does not say its type."""
    with running_node() as node:
        node.declare_parameter("a", 1)
        node.set_descriptor("a", ParameterDescriptor(description="new"))
        return node.describe_parameter("a").type


def on_set_callbacks_without_an_answer():
    """Set a parameter while a callback returns what is no result."""
    with running_node() as node, warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        node.declare_parameter("a", 1)
        results = []
        for answer in (None, True, "text", SetParametersResult(successful=True)):

            def check(parameters, answer=answer):
                return answer

            node.add_on_set_parameters_callback(check)
            results.append(outcome(lambda: node.set_parameters([Parameter("a", value=2)])[0].successful))
            results.append(
                outcome(lambda: node.set_parameters_atomically([Parameter("a", value=3)]).successful)
            )
            node.remove_on_set_parameters_callback(check)
        return [results, [each.category.__name__ for each in caught]]


def values_of_unknown_parameters():
    """Ask a node's services for parameters that it does not have, or that have no value."""
    with running_node() as node:
        node.declare_parameter("a", 1)
        node.declare_parameter("b", Parameter.Type.STRING)
        client, found = AsyncParameterClient(node, "probe"), []
        spin_until(node, client.services_are_ready)
        for names in (["a"], ["a", "b"], ["unknown", "a"]):
            for ask in (client.get_parameters, client.describe_parameters, client.get_parameter_types):
                ask(names, lambda future: found.append(future.result()))
                count = len(found)
                spin_until(node, lambda: len(found) > count)  # noqa: B023

        def items(response):
            (field,) = response.get_fields_and_field_types()
            return getattr(response, field)

        return [len(items(each)) for each in found]
