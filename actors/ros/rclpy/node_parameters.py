"""The parameters of a node.

Its methods and the callbacks run in the thread that calls; requests of other nodes are handled
in the thread that spins.
"""

from __future__ import annotations

import dataclasses
import operator
import warnings
from typing import TYPE_CHECKING, Any

from actors.interfaces.rcl_interfaces.msg import ListParametersResult, SetParametersResult
from actors.interfaces.rcl_interfaces.msg import ParameterDescriptor as DescriptorMessage
from actors.interfaces.rcl_interfaces.msg import ParameterValue as ValueMessage
from actors.parameters.errors import InvalidParameterValueError, ParameterUninitializedError
from actors.parameters.types import (
    Parameter,
    ParameterDescriptor,
    ParameterType,
    parameter_value_to_python,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from actors.ros.rclpy.node_parts import NodeParts


class NodeParameters:
    """rclpy's parameter methods; the store does the work."""

    _callboard: NodeParts

    # Declaring

    def declare_parameter(
        self,
        name: str,
        value: Any = None,
        descriptor: DescriptorMessage | None = None,
        ignore_override: bool = False,
    ) -> Parameter:
        """Declare a parameter, with an override's value if there is one.

        Args:
            name: Its name.
            value: Its default, or a `Parameter.Type`.
            descriptor: The allowed values.
            ignore_override: Use the default in any case.

        Returns:
            The parameter.

        Raises:
            ValueError: There is a descriptor, which does not have `dynamic_typing`, but neither a default nor
                a type; or it has `dynamic_typing`, and there is a type.
        """
        only_name = value is None and descriptor is None
        given = (name,) if only_name else (name, value, descriptor or DescriptorMessage())
        return self.declare_parameters("", [given], ignore_override)[0]

    def declare_parameters(
        self,
        namespace: str,
        parameters: Sequence[tuple[Any, ...]],
        ignore_override: bool = False,
    ) -> list[Parameter]:
        """Declare several parameters: tuples of a name, a default and a descriptor.

        Of several tuples with one name the last one counts.
        """
        wanted = [_declaration(index, each) for index, each in enumerate(parameters)]
        # As in rclpy, whose declarations go through a dict.
        by_name = {each[0]: each for each in wanted}
        # Programs declare and set parameters in several threads; the store itself has no lock.
        with self._callboard.parameters_lock:
            made = self._callboard.store.declare_many(
                namespace, by_name.values(), ignore_override=ignore_override
            )
        declared = dict(zip(by_name, made, strict=True))
        return [declared[each[0]] for each in wanted]

    def undeclare_parameter(self, name: str) -> None:
        """Remove a parameter."""
        with self._callboard.parameters_lock:
            self._callboard.store.undeclare(name)

    def has_parameter(self, name: str) -> bool:
        """Return whether a parameter is declared."""
        return self._callboard.store.has(name)

    # Reading

    def get_parameter(self, name: str) -> Parameter:
        """Return a parameter."""
        return self._callboard.store.get(name)

    def get_parameters(self, names: list[str]) -> list[Parameter]:
        """Return parameters, in order."""
        return [self._callboard.store.get(name) for name in names]

    def get_parameter_or(self, name: str, alternative_value: Parameter | None = None) -> Parameter:
        """Return a parameter, or the alternative if it has no value."""
        return self._callboard.store.get_or(name, alternative_value)

    def get_parameter_type(self, name: str) -> ParameterType:
        """Return the type of a parameter, NOT_SET if it has no value yet."""
        try:
            return self._callboard.store.get(name).type_
        except ParameterUninitializedError:
            return ParameterType.NOT_SET

    def get_parameter_types(self, names: list[str]) -> list[ParameterType]:
        """Return the types of parameters, in order."""
        return [self.get_parameter_type(name) for name in names]

    def get_parameters_by_prefix(self, prefix: str) -> dict[str, Parameter]:
        """Return the parameters below a prefix, by the rest of their names."""
        return self._callboard.store.get_by_prefix(prefix)

    def list_parameters(self, prefixes: list[str], depth: int) -> ListParametersResult:
        """Return the names below prefixes, down to a number of levels; zero for all."""
        if isinstance(prefixes, str):
            raise TypeError(f"prefixes must be a list of names, not {prefixes!r}")
        if operator.index(depth) < 0:
            raise ValueError("The depth must be greater than or equal to zero")
        listed = self._callboard.store.list_names(prefixes, depth)
        return ListParametersResult(names=listed.names, prefixes=listed.prefixes)

    def describe_parameter(self, name: str) -> DescriptorMessage:
        """Return the descriptor of a parameter; an empty one if an undeclared one is allowed."""
        if self._callboard.allow_undeclared and not self._callboard.store.has(name):
            return DescriptorMessage()
        return self._callboard.store.describe(name).to_msg()

    def describe_parameters(self, names: list[str]) -> list[DescriptorMessage]:
        """Return the descriptors of parameters, in order."""
        return [self.describe_parameter(name) for name in names]

    # Setting

    def set_parameters(self, parameter_list: list[Parameter]) -> list[SetParametersResult]:
        """Set parameters one by one, until one is not declared."""
        _require_parameters(parameter_list)
        with self._callboard.parameters_lock:
            # One by one, so that those before an undeclared one stay set: rclpy does the same.
            results = [self._callboard.store.set_atomically([each]) for each in parameter_list]
        return [SetParametersResult(successful=each.successful, reason=each.reason) for each in results]

    def set_parameters_atomically(self, parameter_list: list[Parameter]) -> SetParametersResult:
        """Set all parameters, or none."""
        _require_parameters(parameter_list)
        with self._callboard.parameters_lock:
            result = self._callboard.store.set_atomically(parameter_list)
        return SetParametersResult(successful=result.successful, reason=result.reason)

    def set_descriptor(
        self, name: str, descriptor: DescriptorMessage, alternative_value: ValueMessage | None = None
    ) -> ValueMessage:
        """Replace the descriptor of a parameter, and its value if the new one does not allow that.

        Args:
            name: The parameter's name.
            descriptor: The new descriptor.
            alternative_value: The value to set then; None to raise InvalidParameterValueException.

        Returns:
            The value.
        """
        store, wanted = self._callboard.store, _descriptor(descriptor) or ParameterDescriptor()
        with self._callboard.parameters_lock:
            try:
                # rclpy's rule: the alternative counts only if the present value no longer fits.
                return store.set_descriptor(name, wanted).get_parameter_value()
            except InvalidParameterValueError:
                if alternative_value is None:
                    raise
                other = parameter_value_to_python(alternative_value)
                return store.set_descriptor(name, wanted, other).get_parameter_value()

    def add_pre_set_parameters_callback(self, callback: Callable[[list[Parameter]], list[Parameter]]) -> None:
        """Let a function change parameters before they are set."""
        self._callboard.store.callbacks.pre_set.insert(0, callback)

    def add_on_set_parameters_callback(self, callback: Callable[[list[Parameter]], Any]) -> None:
        """Let a function accept or refuse parameters; it returns a SetParametersResult."""
        self._callboard.store.callbacks.on_set.insert(0, callback)

    def add_post_set_parameters_callback(self, callback: Callable[[list[Parameter]], None]) -> None:
        """Let a function know of parameters that have been set."""
        self._callboard.store.callbacks.post_set.insert(0, callback)

    def remove_pre_set_parameters_callback(self, callback: Callable[..., Any]) -> None:
        """Remove a function that `add_pre_set_parameters_callback` has added; ValueError if it has not."""
        self._callboard.store.callbacks.pre_set.remove(callback)

    def remove_on_set_parameters_callback(self, callback: Callable[..., Any]) -> None:
        """Remove a function that `add_on_set_parameters_callback` has added; ValueError if it has not."""
        self._callboard.store.callbacks.on_set.remove(callback)

    def remove_post_set_parameters_callback(self, callback: Callable[..., Any]) -> None:
        """Remove a function that `add_post_set_parameters_callback` has added; ValueError if it has not."""
        self._callboard.store.callbacks.post_set.remove(callback)


def _declaration(index: int, given: tuple[Any, ...]) -> Any:
    """Return the store's arguments for a tuple of `declare_parameters`; raise as rclpy does."""
    if not 1 <= len(given) <= 3:
        raise TypeError(
            f"Invalid parameter tuple length at index {index} in parameters list: {given};"
            " expecting length between 1 and 3"
        )
    name, value, descriptor = (*given, None, None)[:3]
    if not isinstance(name, str):
        raise TypeError(f"First element {name} at index {index} in parameters list is not a str.")
    if descriptor is None:
        descriptor = DescriptorMessage()
    elif not isinstance(descriptor, DescriptorMessage):
        raise TypeError(f"{descriptor!r} at index {index} in parameters list is no ParameterDescriptor")
    if len(given) == 1:
        warnings.warn(
            f"Parameter '{name}' is declared by its name alone: give it a default, a Parameter.Type, or a"
            " descriptor with dynamic_typing=True",
            stacklevel=4,
        )
        return (name,)
    if isinstance(value, ValueMessage):
        value = parameter_value_to_python(value)
    if isinstance(value, ParameterType) and descriptor.dynamic_typing:
        raise ValueError(f"Parameter '{name}' has a type, and a descriptor with dynamic_typing=True")
    if value is None and not descriptor.dynamic_typing:
        raise ValueError(f"Parameter '{name}' needs a default, a Parameter.Type, or dynamic_typing=True")
    return name, value, _descriptor(descriptor)


def _descriptor(message: DescriptorMessage | None) -> ParameterDescriptor | None:
    """Return a descriptor; its range, if any, is checked with the value."""
    return None if message is None else dataclasses.replace(ParameterDescriptor.from_msg(message), name="")


def _require_parameters(parameters: Iterable[object]) -> None:
    for each in parameters:
        if not isinstance(each, Parameter):
            raise TypeError(f"{each!r} is no rclpy.parameter.Parameter")
