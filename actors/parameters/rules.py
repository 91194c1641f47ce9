"""The rules of a declaration for new values: read-only, type, ranges."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.parameters.types import Parameter, ParameterType

if TYPE_CHECKING:
    from actors.parameters.types import ParameterDescriptor, ParameterValue

MAX_NAME_CHARS: Final = 4096
"""The longest name that setting an undeclared parameter can declare: other nodes may do that, too."""


def as_declared(descriptor: ParameterDescriptor | None, parameter: Parameter) -> Parameter:
    """Return an empty array, which may be of any type, with the type that is declared."""
    if descriptor is None or descriptor.dynamic_typing or descriptor.type is parameter.type_:
        return parameter
    # The type of an empty array in YAML or Python cannot be known, so any array type will do.
    empty = parameter.type_ >= ParameterType.BYTE_ARRAY and not parameter.value
    if not empty or not descriptor.type.check([]):
        return parameter
    return Parameter(parameter.name, descriptor.type, [])


def refusal(descriptor: ParameterDescriptor | None, parameter: Parameter) -> str:
    """Return why a parameter may not be set to a value, "" if it may.

    Args:
        descriptor: Its descriptor; None if it is not declared.
        parameter: Its name and the value to set.
    """
    # Only reached if undeclared parameters are allowed. The name then comes from another node.
    if descriptor is None:
        return "" if 0 < len(parameter.name) <= MAX_NAME_CHARS else "Invalid parameter name"
    if descriptor.read_only:
        return f"Trying to set a read-only parameter: {parameter.name}."
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
