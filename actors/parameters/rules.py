"""Why a value of a parameter is refused by its declaration."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.parameters.types import ParameterType

if TYPE_CHECKING:
    from actors.parameters.types import Parameter, ParameterDescriptor, ParameterValue

MAX_NAME_CHARS: Final = 4096
"""Of a parameter that is declared by setting it, which other nodes can do if the node allows it."""


def refusal(descriptor: ParameterDescriptor | None, parameter: Parameter) -> str:
    """Return why a parameter may not be set to this value, "" if it may; None describes an undeclared one."""
    if descriptor is None:
        return "" if 0 < len(parameter.name) <= MAX_NAME_CHARS else "Invalid parameter name"
    if descriptor.read_only:
        return "Trying to set a read-only parameter"
    if not descriptor.dynamic_typing:
        if parameter.type_ is ParameterType.NOT_SET:
            return "Static parameter cannot be undeclared"
        if not descriptor.type.check(parameter.value):
            return wrong_type(descriptor.type, parameter.value)
    return descriptor.fault(parameter.value)


def wrong_type(expected: ParameterType, value: ParameterValue) -> str:
    """Return the reason for refusing a value of another type."""
    got = ParameterType.from_parameter_value(value)
    hint = f" (write {value}.0)" if expected is ParameterType.DOUBLE and got is ParameterType.INTEGER else ""
    return f"Wrong parameter type, expected {expected.name} got {got.name}{hint}"
