"""What nodes answer about themselves as plain data for JSON: what `--json` prints (docs/reference/json.md).

Pure: no I/O.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from actors.interfaces.convert import message_to_ordereddict
from actors.logging.severity import LoggingSeverity

if TYPE_CHECKING:
    from actors.interfaces.callboard_interfaces.srv import GetDiagnostics
    from actors.interfaces.lifecycle_msgs.msg import TransitionDescription
    from actors.interfaces.rcl_interfaces.msg import Log
    from actors.parameters.types import Parameter, ParameterDescriptor

PARAMETER_TYPES: Final = (
    "not set", "boolean", "integer", "double", "string", "byte array", "boolean array", "integer array",
    "double array", "string array",
)  # fmt: skip
"""Names of types by ROS 2's numbers."""


def parameter(found: Parameter) -> dict[str, Any]:
    """Return a parameter: name, type, value; bytes as a list of numbers.

    Args:
        found: The parameter.
    """
    value = [*found.value] if isinstance(found.value, bytes) else found.value
    return {"name": found.name, "type": PARAMETER_TYPES[found.type_], "value": value}


def descriptor(found: ParameterDescriptor) -> dict[str, Any]:
    """Return a descriptor: name, type, description, constraints, read_only, dynamic_typing, range.

    Args:
        found: The descriptor.
    """
    limits = next(iter(found.floating_point_range), None) or next(iter(found.integer_range), None)
    return {
        "name": found.name,
        "type": PARAMETER_TYPES[found.type],
        "description": found.description,
        "additional_constraints": found.additional_constraints,
        "read_only": found.read_only,
        "dynamic_typing": found.dynamic_typing,
        "range": limits
        and {"from_value": limits.from_value, "to_value": limits.to_value, "step": limits.step},
    }


def transition(found: TransitionDescription) -> dict[str, Any]:
    """Return a transition: id, label, start_state, goal_state.

    Args:
        found: Its description.
    """
    return {
        "id": found.transition.id,
        "label": found.transition.label,
        "start_state": found.start_state.label,
        "goal_state": found.goal_state.label,
    }


def diagnostics(name: str, found: GetDiagnostics.Response) -> dict[str, Any]:
    """Return what a node answers to `~/get_diagnostics`, and its name.

    Args:
        name: The node's full name.
        found: Its answer.
    """
    document = {"node": name, **message_to_ordereddict(found)}
    del document["stamp"]
    return {**document, "stamp_ns": found.stamp.sec * 1_000_000_000 + found.stamp.nanosec}


def log_line(found: Log, node: str) -> dict[str, Any]:
    """Return a line of a log: node, severity, and the fields of the message.

    Args:
        found: The message.
        node: The full name of the node that published it.
    """
    return {"node": node, "severity": severity_name(found.level), **message_to_ordereddict(found)}


def severity_name(level: int) -> str:
    """Return the name of a level; "Level N" if it has none.

    Args:
        level: The number.
    """
    try:
        return LoggingSeverity(level).name
    except ValueError:
        return f"Level {level}"
