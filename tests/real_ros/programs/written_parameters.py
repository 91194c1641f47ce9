"""Parameters on the real side: what rcl reads in files and arguments, what ROS 2's tools make of texts."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path

import yaml
from rclpy.context import Context
from rclpy.node import Node
from rclpy.parameter import get_parameter_value, parameter_value_to_python


def of_file(text):
    """Return the values that a node gets from a parameter file, by name.

    Args:
        text: The file.
    """
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "parameters.yaml")
        path.write_text(text, encoding="utf-8", newline="")
        return _of_arguments(["--params-file", str(path)])


def of_rules(texts):
    """Return the values that a node gets from `-p` arguments.

    Args:
        texts: The text after `:=` of each.
    """
    arguments = [argument for at, text in enumerate(texts) for argument in ("-p", f"p{at}:={text}")]
    found = _of_arguments(arguments)
    return [found[f"p{at}"] for at in range(len(texts))]


def of_sources(sources):
    """Return the values that a node gets from files and `-p` arguments, in their order.

    Args:
        sources: Of each, "file" and its text, or "rule" and the argument of `-p`.
    """
    arguments = []
    with tempfile.TemporaryDirectory() as folder:
        for at, (kind, text) in enumerate(sources):
            if kind == "rule":
                arguments += ["-p", text]
            else:
                path = Path(folder, f"{at}.yaml")
                path.write_text(text, encoding="utf-8")
                arguments += ["--params-file", str(path)]
        return _of_arguments(arguments)


def of_launch(texts):
    """Return the values that a node gets if launch has these texts for parameters, or what is raised.

    launch_ros reads the text of a substitution with PyYAML, refuses what is no scalar and no list of one
    type, and writes a file for the node with PyYAML.

    Args:
        texts: The texts of substitutions.
    """
    return [_answer(_launched, text) for text in texts]


def _launched(text):
    value = yaml.safe_load(text) if text else ""
    listed = value if isinstance(value, list) else [value]
    kinds = {type(each) for each in listed}
    if len(kinds) != 1 or not kinds <= {bool, int, float, str}:
        raise TypeError(f"launch_ros refuses {value!r}")
    return of_file(yaml.dump({"/**": {"ros__parameters": {"p": value}}}, default_flow_style=False))["p"]


def of_launch_bool(texts):
    """Return the truth values that options and typed parameters have in launch, or what is raised.

    launch reads 1 and 0 itself, and other texts with PyYAML.

    Args:
        texts: The texts.
    """
    return [_answer(_truth, text) for text in texts]


def _truth(text):
    value = yaml.safe_load({"1": "true", "0": "false"}.get(text, text))
    if not isinstance(value, bool):
        raise TypeError(f"launch refuses {value!r}")
    return value


def of_param_set(texts):
    """Return the values that `ros2 param set` sends for these texts; or what is raised.

    Args:
        texts: The values on the command line.
    """
    return [_answer(_set, text) for text in texts]


def _set(text):
    value = parameter_value_to_python(get_parameter_value(text))
    if isinstance(value, bool | float | str) or (isinstance(value, int) and -(1 << 63) <= value < 1 << 63):
        return value
    # Nothing is checked at assignment: the message with a dict, a date or a larger integer cannot be sent.
    if isinstance(value, Sequence):
        return list(value)
    raise TypeError(f"no parameter can be {value!r}")


def _answer(function, text):
    try:
        return function(text)
    except Exception as error:  # noqa: BLE001 - PyYAML, rclpy and launch_ros raise whatever they do
        return {"refused": type(error).__name__}


def _of_arguments(arguments):
    context = Context()
    context.init(["program", "--ros-args", *arguments])
    try:
        node = Node(
            "n",
            context=context,
            enable_rosout=False,
            start_parameter_services=False,
            automatically_declare_parameters_from_overrides=True,
        )
        try:
            own = {"use_sim_time", "start_type_description_service"}
            found = node.get_parameters_by_prefix("")
            return {name: _plain(each.value) for name, each in found.items() if name not in own}
        finally:
            node.destroy_node()
    finally:
        context.shutdown()


def _plain(value):
    # Numbers in arrays.
    return value if isinstance(value, bool | int | float | str) else list(value)
