"""rclpy's functions for values and files of parameters."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from actors.interfaces.rcl_interfaces.msg import Parameter as ParameterMessage
from actors.interfaces.rcl_interfaces.msg import ParameterDescriptor, ParameterValue
from actors.parameters.types import ParameterType
from actors.ros.rclpy.exceptions import ParameterAlreadyDeclaredException
from actors.ros.rclpy.node import Node
from actors.ros.rclpy.parameter import (
    Parameter,
    get_parameter_value,
    parameter_dict_from_yaml_file,
    parameter_value_to_python,
)
from actors.ros.rclpy.type_description_service import START_TYPE_DESCRIPTION_SERVICE_PARAM

if TYPE_CHECKING:
    from pathlib import Path

    from actors.ros.rclpy.context import Context

FILE = """
/**:
  ros__parameters: {speed: 1, color: red}
/arm:
  ros__parameters: {speed: 2, joint: {limits: [1.0, 2.0]}}
leg:
  ros__parameters: {length: 3}
"""


def test_texts_become_values() -> None:
    """YAML decides the type of a text; a text that no parameter can hold remains one."""
    texts = ("true", "1", "1.5", "[1, 2]", "[a, b]", "[1, a]", "{a: 1}", "", "red")
    assert [parameter_value_to_python(get_parameter_value(each)) for each in texts] == [
        True, 1, 1.5, [1, 2], ["a", "b"], "[1, a]", "{a: 1}", "", "red",
    ]  # fmt: skip
    with pytest.raises(RuntimeError, match="42"):
        parameter_value_to_python(ParameterValue(type=42))


def test_arrays_of_bytes_are_lists_of_single_bytes() -> None:
    """Received messages have such lists; parameters and values are made of them."""
    value = ParameterValue(type=ParameterType.BYTE_ARRAY)
    unchecked: Any = value
    unchecked.byte_array_value = [b"a", b"b"]
    assert parameter_value_to_python(value) == [b"a", b"b"]
    assert Parameter.from_parameter_msg(ParameterMessage(name="p", value=value)).value == b"ab"
    assert parameter_value_to_python(Parameter("p", value=b"ab").get_parameter_value()) == [b"a", b"b"]


def test_files_become_messages(tmp_path: Path) -> None:
    """Nested names are joined, and what a file has for one node wins over what it has for all."""
    file = tmp_path / "parameters.yaml"
    file.write_text(FILE)

    def read(**options: object) -> dict[str, object]:
        messages = parameter_dict_from_yaml_file(str(file), **options)  # type: ignore[arg-type]
        assert all(name == each.name for name, each in messages.items())
        return {name: Parameter.from_parameter_msg(each).value for name, each in messages.items()}

    assert read() == {"speed": 2, "joint.limits": [1.0, 2.0], "length": 3}
    assert read(use_wildcard=True, target_nodes=["/arm"], namespace="my.") == {
        "my.speed": 2, "my.color": "red", "my.joint.limits": [1.0, 2.0],
    }  # fmt: skip
    assert read(target_nodes=["leg"]) == {"length": 3}


def test_unusable_files_are_named(tmp_path: Path) -> None:
    """A missing file, one of another form, and one without the wanted node raise as in rclpy."""
    file = tmp_path / "parameters.yaml"
    with pytest.raises(FileNotFoundError):
        parameter_dict_from_yaml_file(str(file))
    file.write_text("arm: 1")
    with pytest.raises(RuntimeError, match="ros__parameters"):
        parameter_dict_from_yaml_file(str(file))
    file.write_text(FILE)
    with pytest.raises(RuntimeError, match="no parameters of /head, only of"):
        parameter_dict_from_yaml_file(str(file), target_nodes=["head"])
    file.write_text("/**:\n  ros__parameters: {speed: 1}")
    with pytest.raises(RuntimeError, match="none of the wanted"):
        parameter_dict_from_yaml_file(str(file))


def test_a_declared_parameter_has_a_type(context: Context) -> None:
    """A name alone is a warning, a wrong descriptor an error; messages are defaults, too."""
    node = Node("node", context=context)
    with pytest.warns(UserWarning, match="'old' is declared by its name alone"):
        assert node.declare_parameter("old").value is None
    dynamic = ParameterDescriptor(dynamic_typing=True)
    assert node.declare_parameter("any", descriptor=dynamic).value is None
    assert node.declare_parameter("message", Parameter("", value=5).get_parameter_value()).value == 5
    assert node.declare_parameter("empty", ParameterValue(), dynamic).value is None
    for name, *rest in (
        ("none", None),
        ("none", ParameterValue()),
        ("none", None, ParameterDescriptor(type=ParameterType.STRING)),
        ("both", ParameterType.DOUBLE, dynamic),
    ):
        with pytest.raises(ValueError, match=f"Parameter '{name}'"):
            node.declare_parameters("", [(name, *rest)])
    with pytest.raises(TypeError, match="no ParameterDescriptor"):
        node.declare_parameters("", [("wrong", 1, ParameterValue())])
    assert not any(node.has_parameter(each) for each in ("none", "both", "wrong"))


def test_of_several_declarations_of_a_name_the_last_counts(context: Context) -> None:
    """In one call; a second call is an error."""
    node = Node("node", context=context)
    declared = node.declare_parameters("", [("a", 1), ("b", 2), ("a", 3)])
    assert [(each.name, each.value) for each in declared] == [("a", 3), ("b", 2), ("a", 3)]
    with pytest.raises(ParameterAlreadyDeclaredException):
        node.declare_parameters("", [("a", 1)])


def test_parameters_are_members_of_sets() -> None:
    """Also those with lists; equal ones are one member."""
    lists = Parameter("a", value=[1]), Parameter("a", value=[1]), Parameter("a", value=[2])
    assert {*lists} == {lists[0], lists[2]}


def test_sections_of_one_name_in_a_file_add_up(context: Context, tmp_path: Path) -> None:
    """A node gets the parameters of all sections that fit."""
    file = tmp_path / "parameters.yaml"
    file.write_text("/**: {ros__parameters: {a: 1}}\n/**: {node: {ros__parameters: {b: 2}}}\n")
    arguments = ["--ros-args", "--params-file", str(file)]
    node = Node(
        "node", context=context, cli_args=arguments, automatically_declare_parameters_from_overrides=True
    )
    assert [each.value for each in node.get_parameters(["a", "b"])] == [1, 2]


def test_a_parameter_switches_the_service_for_types(context: Context) -> None:
    """A node has it under the name that programs import."""
    switched_off = Parameter(START_TYPE_DESCRIPTION_SERVICE_PARAM, value=False)
    node = Node("node", context=context, parameter_overrides=[switched_off])
    assert node.get_parameter(START_TYPE_DESCRIPTION_SERVICE_PARAM).value is False
    services = node.get_service_names_and_types_by_node("node", "/")
    assert "/node/get_type_description" not in dict(services)
