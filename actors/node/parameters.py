"""rclpy's parameter methods: a part of Node."""

from __future__ import annotations

from typing import TYPE_CHECKING

from actors.parameters.callbacks import require_plain
from actors.parameters.errors import ParameterUninitializedError
from actors.parameters.types import ParameterType

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from actors.interfaces.rcl_interfaces.msg import ParameterValue as ParameterValueMessage
    from actors.parameters.callbacks import OnSetCallback, PostSetCallback, PreSetCallback
    from actors.parameters.store import ParameterStore
    from actors.parameters.types import (
        ListParametersResult,
        Parameter,
        ParameterDescriptor,
        ParameterValue,
        SetParametersResult,
    )


class NodeParameters:
    """A node's parameters, under rclpy's names; `ParameterStore` does the work."""

    _parameters: ParameterStore

    def declare_parameter(
        self,
        name: str,
        value: ParameterValue | ParameterType = None,
        descriptor: ParameterDescriptor | None = None,
        ignore_override: bool = False,  # noqa: FBT001, FBT002 - rclpy's order
    ) -> Parameter:
        """Declare a parameter; an override from the command line, a file or the constructor wins.

        Args:
            name: The parameter's name.
            value: The default, or a type for a parameter without one.
            descriptor: Constraints and description.
            ignore_override: Use `value` also if there is an override.

        Returns:
            The parameter.

        Raises:
            ParameterAlreadyDeclaredError: It is declared already.
            InvalidParameterError: The name is empty.
            InvalidParameterTypeError: The override has another type than `value`.
            InvalidParameterValueError: A range or an on-set callback refuses the value.
            ParameterModifiedInCallbackError: Called in a pre-set or on-set callback.
            TypeError: The name is not a str, or no parameter can hold the value.
            ValueError: `value` is `ParameterType.NOT_SET`.
        """
        return self._parameters.declare(name, value, descriptor, ignore_override=ignore_override)

    def declare_parameters(
        self,
        namespace: str,
        parameters: Iterable[
            tuple[str]
            | tuple[str, ParameterValue | ParameterType]
            | tuple[str, ParameterValue | ParameterType, ParameterDescriptor]
        ],
        ignore_override: bool = False,  # noqa: FBT001, FBT002 - rclpy's order
    ) -> list[Parameter]:
        """Declare several parameters below a namespace.

        Args:
            namespace: Put before each name, with a dot; "" for none.
            parameters: Tuples of name, value and descriptor; the last two may be missing.
            ignore_override: As for `declare_parameter`.

        Returns:
            The parameters, in the same order.

        Raises:
            ParameterAlreadyDeclaredError: One is declared already, or a name occurs twice.
            InvalidParameterError: A name is empty.
            InvalidParameterTypeError: As for `declare_parameter`; those before it stay declared.
            InvalidParameterValueError: As for `declare_parameter`; those before it stay declared.
            ParameterModifiedInCallbackError: As for `declare_parameter`.
            TypeError: A name is not a str, or no parameter can hold a value.
            ValueError: A value is `ParameterType.NOT_SET`.
        """
        return self._parameters.declare_many(namespace, parameters, ignore_override=ignore_override)

    def undeclare_parameter(self, name: str) -> None:
        """Remove a parameter: its declaration and its value.

        Args:
            name: The parameter's name.

        Raises:
            ParameterNotDeclaredError: It is not declared.
            ParameterImmutableError: It is read-only.
            ParameterModifiedInCallbackError: Called in a pre-set or on-set callback.
        """
        self._parameters.undeclare(name)

    def has_parameter(self, name: str) -> bool:
        """Return whether a parameter is declared.

        Args:
            name: The parameter's name.

        Returns:
            True if it is declared.
        """
        return self._parameters.has(name)

    def get_parameter(self, name: str) -> Parameter:
        """Return a parameter; its value is `.value`.

        Args:
            name: The parameter's name.

        Returns:
            The parameter. Of an undeclared one, if the node allows that: one without a value.

        Raises:
            ParameterNotDeclaredError: It is not declared, and the node does not allow undeclared ones.
            ParameterUninitializedError: It was declared with only a type and has no value yet.
        """
        return self._parameters.get(name)

    def get_parameters(self, names: Sequence[str]) -> list[Parameter]:
        """Return several parameters.

        Args:
            names: Their names.

        Returns:
            The parameters, in the same order.

        Raises:
            ParameterNotDeclaredError: As for `get_parameter`.
            ParameterUninitializedError: One was declared with only a type and has no value yet.
        """
        return [self._parameters.get(name) for name in names]

    def get_parameter_type(self, name: str) -> ParameterType:
        """Return the type of a parameter's value.

        Args:
            name: The parameter's name.

        Returns:
            The type; NOT_SET if it has no value, or is not declared and undeclared ones are allowed.

        Raises:
            ParameterNotDeclaredError: It is not declared.
        """
        try:
            return self._parameters.get(name).type_
        # Declared with a type only: there is no value yet whose type could be returned.
        except ParameterUninitializedError:
            return ParameterType.NOT_SET

    def get_parameter_types(self, names: Sequence[str]) -> list[ParameterType]:
        """Return the types of several parameters.

        Args:
            names: Their names.

        Returns:
            The types, in the same order.

        Raises:
            ParameterNotDeclaredError: One is not declared.
        """
        return [self.get_parameter_type(name) for name in names]

    def get_parameter_or(self, name: str, alternative_value: Parameter | None = None) -> Parameter:
        """Return a parameter, or the alternative if it is not declared or has no value.

        Args:
            name: The parameter's name.
            alternative_value: Returned instead; None: a parameter of that name without a value.

        Returns:
            The parameter, or the alternative.
        """
        return self._parameters.get_or(name, alternative_value)

    def get_parameters_by_prefix(self, prefix: str) -> dict[str, Parameter]:
        """Return the parameters below a prefix, without it.

        Args:
            prefix: A part of the name that ends before a dot; "" for all.

        Returns:
            The parameters, by the rest of their names.
        """
        return self._parameters.get_by_prefix(prefix)

    def set_parameters(self, parameter_list: Sequence[Parameter]) -> list[SetParametersResult]:
        """Set parameters one by one; each has its own result.

        Args:
            parameter_list: Names and values.

        Returns:
            One result for each, in the same order.

        Raises:
            ParameterNotDeclaredError: One is not declared; then none is set.
            ParameterModifiedInCallbackError: Called in a pre-set or on-set callback.
        """
        return self._parameters.set(parameter_list)

    def set_parameters_atomically(self, parameter_list: Sequence[Parameter]) -> SetParametersResult:
        """Set all of the parameters, or none.

        Args:
            parameter_list: Names and values.

        Returns:
            The result for all.

        Raises:
            ParameterNotDeclaredError: One is not declared; then none is set.
            ParameterModifiedInCallbackError: Called in a pre-set or on-set callback.
        """
        return self._parameters.set_atomically(parameter_list)

    def list_parameters(self, prefixes: Sequence[str], depth: int) -> ListParametersResult:
        """List the names of parameters.

        Args:
            prefixes: Only these names and those below them, levels separated by dots; empty for all.
            depth: Levels below each prefix, or from the top; 0 for all.

        Returns:
            The names, and what precedes the last dot of each.

        Raises:
            TypeError: `prefixes` is a str.
            ValueError: `depth` is negative.
        """
        return self._parameters.list_names(prefixes, depth)

    def describe_parameter(self, name: str) -> ParameterDescriptor:
        """Return the constraints of a parameter.

        Args:
            name: The parameter's name.

        Returns:
            The descriptor.

        Raises:
            ParameterNotDeclaredError: It is not declared.
        """
        return self._parameters.describe(name)

    def describe_parameters(self, names: Sequence[str]) -> list[ParameterDescriptor]:
        """Return the constraints of several parameters.

        Args:
            names: Their names.

        Returns:
            The descriptors, in the same order.

        Raises:
            ParameterNotDeclaredError: One is not declared.
        """
        return [self._parameters.describe(name) for name in names]

    def set_descriptor(
        self, name: str, descriptor: ParameterDescriptor, alternative_value: ParameterValue = None
    ) -> ParameterValueMessage:
        """Replace the constraints of a parameter, and its value if one is given.

        Args:
            name: The parameter's name.
            descriptor: The new constraints; `name` and `type` are filled in.
            alternative_value: A value for it; None keeps the value.

        Returns:
            The value, as ROS 2's message.

        Raises:
            ParameterNotDeclaredError: It is not declared.
            ParameterImmutableError: It is read-only.
            InvalidParameterTypeError: The alternative has another type than the parameter.
            InvalidParameterValueError: The new constraints, or an on-set callback, refuse the value.
            ParameterModifiedInCallbackError: Called in a pre-set or on-set callback.
        """
        return self._parameters.set_descriptor(name, descriptor, alternative_value).get_parameter_value()

    def add_pre_set_parameters_callback(self, callback: PreSetCallback) -> None:
        """Let `callback` change parameters before they are set, or refuse them all with an empty list.

        The last one added is called first.

        Args:
            callback: Gets the parameters, and returns those to set.

        Raises:
            TypeError: The callback is an `async def`.
        """
        # In front, as in rclpy: callbacks of a subclass are added later, and see the parameters before the
        # base's do.
        self._parameters.callbacks.pre_set.insert(0, require_plain(callback))

    def add_on_set_parameters_callback(self, callback: OnSetCallback) -> None:
        """Let `callback` accept or refuse parameters before they are set. The last one added is called first.

        Args:
            callback: Gets the parameters, and returns the result.

        Raises:
            TypeError: The callback is an `async def`.
        """
        self._parameters.callbacks.on_set.insert(0, require_plain(callback))

    def add_post_set_parameters_callback(self, callback: PostSetCallback) -> None:
        """Call `callback` after parameters have been set. The last one added is called first.

        Args:
            callback: Gets the parameters.

        Raises:
            TypeError: The callback is an `async def`.
        """
        self._parameters.callbacks.post_set.insert(0, require_plain(callback))

    def remove_pre_set_parameters_callback(self, callback: PreSetCallback) -> None:
        """Undo `add_pre_set_parameters_callback`.

        Args:
            callback: The callback.

        Raises:
            ValueError: It is not registered.
        """
        self._parameters.callbacks.pre_set.remove(callback)

    def remove_on_set_parameters_callback(self, callback: OnSetCallback) -> None:
        """Undo `add_on_set_parameters_callback`.

        Args:
            callback: The callback.

        Raises:
            ValueError: It is not registered.
        """
        self._parameters.callbacks.on_set.remove(callback)

    def remove_post_set_parameters_callback(self, callback: PostSetCallback) -> None:
        """Undo `add_post_set_parameters_callback`.

        Args:
            callback: The callback.

        Raises:
            ValueError: It is not registered.
        """
        self._parameters.callbacks.post_set.remove(callback)
