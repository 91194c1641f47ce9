"""The parameters of one node: declarations, values, and the rules for setting them."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Final

from actors.parameters.callbacks import ParameterCallbacks
from actors.parameters.changes import ParameterChanges
from actors.parameters.errors import (
    InvalidParameterError,
    InvalidParameterTypeError,
    InvalidParameterValueError,
    ParameterAlreadyDeclaredError,
    ParameterImmutableError,
    ParameterNotDeclaredError,
    ParameterUninitializedError,
)
from actors.parameters.listing import SEPARATOR, list_names
from actors.parameters.rules import as_declared, refusal, wrong_type
from actors.parameters.types import (
    Parameter,
    ParameterDescriptor,
    ParameterType,
    SetParametersResult,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from actors.parameters.types import ListParametersResult, ParameterValue

MAX_PARAMETERS: Final = 100_000
"""Parameters of one node. Other nodes can declare some by setting them, if undeclared ones are allowed."""

_ALWAYS: Final = (
    (
        Parameter("use_sim_time", value=False),
        ParameterDescriptor(name="use_sim_time", type=ParameterType.BOOL),
    ),
    (
        Parameter("start_type_description_service", value=True),
        ParameterDescriptor(
            name="start_type_description_service",
            type=ParameterType.BOOL,
            description="If enabled, start the type description service.",
            read_only=True,
        ),
    ),
)
"""The parameters that every node declares."""


class ParameterStore:
    """All parameters of one node. It does no I/O.

    `use_sim_time` and `start_type_description_service` are always declared.

    Args:
        overrides: Values from the node's constructor, by name; they take precedence.
        argument_overrides: Values from the command line and its files.
        allow_undeclared: Reading an undeclared parameter returns one without a value; setting it declares it.
        max_parameters: Limit on all parameters when others set undeclared ones.

    Attributes:
        callbacks: The callbacks around setting parameters. While one of them decides about values, nothing
            may be declared, set or removed.
        listeners: Called with the changes, before the post-set callbacks.

    Raises:
        InvalidParameterTypeError: An override of an always-declared parameter has another type.
    """

    def __init__(
        self,
        *,
        overrides: Mapping[str, ParameterValue] | None = None,
        argument_overrides: Mapping[str, ParameterValue] | None = None,
        allow_undeclared: bool = False,
        max_parameters: int = MAX_PARAMETERS,
    ) -> None:
        # The constructor's values come last, and so win: the code that makes the node knows best what it
        # needs.
        self._overrides: dict[str, ParameterValue] = {**(argument_overrides or {}), **(overrides or {})}
        self._allow_undeclared = allow_undeclared
        self._max_parameters = max_parameters
        self._parameters: dict[str, Parameter] = {}
        self._descriptors: dict[str, ParameterDescriptor] = {}
        self.callbacks = ParameterCallbacks()
        self.listeners: list[Callable[[ParameterChanges], None]] = []
        for parameter, descriptor in _ALWAYS:
            name = parameter.name
            if name in self._overrides:
                self.declare(name, parameter.value, descriptor)
            else:  # the same objects in all nodes
                self._parameters[name], self._descriptors[name] = parameter, descriptor

    def declare_overrides(self) -> None:
        """Declare every override that is not declared."""
        for name, value in self._overrides.items():
            if name not in self._parameters:
                self.declare(name, value)

    def declare(
        self,
        name: str,
        default: ParameterValue | ParameterType = None,
        descriptor: ParameterDescriptor | None = None,
        *,
        ignore_override: bool = False,
    ) -> Parameter:
        """Declare a parameter, with an override's value if there is one.

        Its type is then fixed, unless the descriptor has `dynamic_typing`, or there is neither a default nor
        a type.

        Args:
            name: Its name, not empty.
            default: Its value, or only its type: then it has no value until an override or a set gives one.
            descriptor: The allowed values; its `name` and `type` are filled in.
            ignore_override: Use the default even if there is an override.

        Returns:
            The parameter.

        Raises:
            TypeError: The name is not a str, or no parameter can hold the value.
            InvalidParameterError: The name is empty.
            ParameterAlreadyDeclaredError: It is already declared.
            InvalidParameterTypeError: The override has another type than the default.
            InvalidParameterValueError: A range or an on-set callback refuses the value.
            ParameterModifiedInCallbackError: A callback is deciding about values.
        """
        # First of all: while a callback decides about values, the store must not change below it.
        self.callbacks.require_idle(name)
        self._check_new_name(name)
        descriptor = descriptor or ParameterDescriptor()
        kind, value = _type_and_value(default)
        # Neither a value nor a type says what it may hold, so that it may hold anything.
        if kind is ParameterType.NOT_SET:
            descriptor = dataclasses.replace(descriptor, dynamic_typing=True)
        if name in self._overrides and not ignore_override:
            value = self._overrides[name]
        if descriptor.dynamic_typing:
            kind = ParameterType.from_parameter_value(value)
        descriptor = dataclasses.replace(descriptor, name=name, type=kind)
        if value is None:
            parameter = Parameter(name)
        else:
            parameter = self._checked_for_declaration(name, value, descriptor)
        # Nothing is stored before this line, so that a refused declaration leaves no trace.
        self._descriptors[name] = descriptor
        self._parameters[name] = parameter
        self._report({name: None})
        if value is not None:
            self.callbacks.notify([parameter])
        return parameter

    def declare_many(
        self,
        namespace: str,
        parameters: Iterable[
            tuple[str]
            | tuple[str, ParameterValue | ParameterType]
            | tuple[str, ParameterValue | ParameterType, ParameterDescriptor]
        ],
        *,
        ignore_override: bool = False,
    ) -> list[Parameter]:
        """Declare several parameters as `declare` does.

        All names are checked before the first is declared; after a wrong value those before it stay declared.

        Args:
            namespace: Prefix of their names, added with a dot; "" for none.
            parameters: Arguments of `declare` for each: name, default, descriptor.
            ignore_override: Use the defaults even if there are overrides.

        Returns:
            The parameters, in order.
        """
        prefix = f"{namespace}{SEPARATOR}" if namespace else ""
        # Twice over the list: a wrong name must be found before the first parameter is declared.
        wanted = list(parameters)
        names: set[str] = set()
        for item in wanted:
            _check_name(item[0])
            name = prefix + item[0]
            if name in names:
                raise ParameterAlreadyDeclaredError(name)
            self._check_new_name(name)
            names.add(name)
        declared: list[Parameter] = []
        for name, *rest in wanted:
            declared.append(self.declare(prefix + name, *rest, ignore_override=ignore_override))  # pyright: ignore[reportArgumentType]
        return declared

    def undeclare(self, name: str) -> None:
        """Remove a parameter.

        Raises:
            ParameterNotDeclaredError: It is not declared.
            ParameterImmutableError: It is read only.
            ParameterModifiedInCallbackError: A callback is deciding about values.
        """
        self.callbacks.require_idle(name)
        if self.describe(name).read_only:
            raise ParameterImmutableError(name)
        before = {name: self._parameters[name]}
        self._forget(name)
        self._report(before)

    def has(self, name: str) -> bool:
        """Return whether a parameter is declared."""
        return name in self._parameters

    def get(self, name: str) -> Parameter:
        """Return a parameter.

        Raises:
            ParameterNotDeclaredError: It is not declared, and undeclared ones are not allowed.
            ParameterUninitializedError: It was declared with only a type and has no value yet.
        """
        parameter = self._parameters.get(name)
        if parameter is None:
            if self._allow_undeclared:
                return Parameter(name)
            raise ParameterNotDeclaredError(name)
        if parameter.type_ is ParameterType.NOT_SET and not self._descriptors[name].dynamic_typing:
            raise ParameterUninitializedError(name)
        return parameter

    def get_or(self, name: str, alternative: Parameter | None = None) -> Parameter:
        """Return a parameter, or the alternative (by default one without a value) if it has no value."""
        parameter = self._parameters.get(name)
        if parameter is None or parameter.type_ is ParameterType.NOT_SET:
            return Parameter(name) if alternative is None else alternative
        return parameter

    def get_by_prefix(self, prefix: str) -> dict[str, Parameter]:
        """Return the parameters below a prefix, by the rest of their names; all for an empty prefix."""
        start = f"{prefix}{SEPARATOR}" if prefix else ""
        found = self._parameters.items()
        return {name.removeprefix(start): each for name, each in found if name.startswith(start)}

    def list_names(self, prefixes: Sequence[str] = (), depth: int = 0) -> ListParametersResult:
        """List names as `listing.list_names` does."""
        return list_names(self._parameters, prefixes, depth)

    def describe(self, name: str) -> ParameterDescriptor:
        """Return the descriptor of a parameter.

        Raises:
            ParameterNotDeclaredError: It is not declared.
        """
        try:
            return self._descriptors[name]
        except KeyError:
            raise ParameterNotDeclaredError(name) from None

    def set_descriptor(
        self, name: str, descriptor: ParameterDescriptor, alternative: ParameterValue = None
    ) -> Parameter:
        """Replace the descriptor of a parameter; its type stays unless the descriptor has `dynamic_typing`.

        Args:
            name: The parameter's name.
            descriptor: The new one; its `name` and `type` are filled in.
            alternative: The value to set at the same time; None keeps the value.

        Returns:
            The parameter.

        Raises:
            ParameterNotDeclaredError: It is not declared.
            ParameterImmutableError: It is read only.
            InvalidParameterTypeError: The value has another type.
            InvalidParameterValueError: A range of the new descriptor, or an on-set callback, refuses the
                value; the descriptor stays as it was.
            ParameterModifiedInCallbackError: A callback is deciding about values.
        """
        self.callbacks.require_idle(name)
        earlier = self.describe(name)
        if earlier.read_only:
            raise ParameterImmutableError(name)
        parameter = self._parameters[name]
        value = parameter.value if alternative is None else alternative
        kind = earlier.type
        if descriptor.dynamic_typing:
            kind = ParameterType.from_parameter_value(value)
        descriptor = dataclasses.replace(descriptor, name=name, type=kind)
        # The new constraints hold for the value that is there as well; otherwise the parameter would break
        # its own rules.
        if alternative is None and value is not None and (reason := descriptor.fault(value)):
            raise InvalidParameterValueError(name, value, reason)
        if alternative is not None:
            parameter = self._checked_for_declaration(name, alternative, descriptor)
        before = {name: self._parameters[name]}
        self._descriptors[name] = descriptor
        if alternative is not None:
            self._parameters[name] = parameter
            self._report(before)
            self.callbacks.notify([parameter])
        return parameter

    def set(self, parameters: Sequence[Parameter]) -> list[SetParametersResult]:
        """Set parameters one by one; a refused one does not affect the others.

        Returns:
            One result for each, in order.

        Raises:
            ParameterNotDeclaredError: One is not declared; then none is set.
            ParameterModifiedInCallbackError: A callback is deciding about values.
        """
        # All names are checked before the first value is set, so that a misspelt one changes nothing.
        self._check_declared(parameters)
        return [self.set_atomically([parameter]) for parameter in parameters]

    def set_atomically(self, parameters: Sequence[Parameter]) -> SetParametersResult:
        """Set all of these parameters, or none.

        Returns:
            The result for all of them.

        Raises:
            ParameterNotDeclaredError: One is not declared; then none is set.
            ParameterModifiedInCallbackError: A callback is deciding about values.
        """
        for parameter in parameters:
            self.callbacks.require_idle(parameter.name)
        self._check_declared(parameters)
        # A copy: the callback may change the list, and the caller keeps its own.
        wanted = self.callbacks.rewrite([*parameters])
        if wanted is None:
            return SetParametersResult(successful=False, reason="a pre-set callback returned no parameters")
        # Again, since a pre-set callback may have added parameters.
        self._check_declared(wanted)
        wanted = [as_declared(self._descriptors.get(parameter.name), parameter) for parameter in wanted]
        refusals = (refusal(self._descriptors.get(parameter.name), parameter) for parameter in wanted)
        # The declared rules first: on-set callbacks need not check what the descriptor says already.
        if reason := next(filter(None, refusals), "") or self.callbacks.refusal(wanted):
            return SetParametersResult(successful=False, reason=reason)
        # Only now, as the callbacks may have run code that takes time to think; nothing else runs from here
        # to the end.
        before = {parameter.name: self._parameters.get(parameter.name) for parameter in wanted}
        # Other nodes can declare parameters by setting them, so their number needs a limit.
        if len(self._parameters) + list(before.values()).count(None) > self._max_parameters:
            reason = f"the node has {len(self._parameters)} parameters already"
            return SetParametersResult(successful=False, reason=reason)
        # No check below may fail: either all are stored, or none was.
        for parameter in wanted:
            self._store(parameter)
        # Listeners before users' callbacks, which may raise or set further parameters: events then come in
        # order.
        self._report(before)
        self.callbacks.notify(wanted)
        return SetParametersResult(successful=True)

    def _report(self, before: Mapping[str, Parameter | None]) -> None:
        if self.listeners and (changes := ParameterChanges.between(before, self._parameters)):
            for listener in self.listeners:
                listener(changes)

    def _check_new_name(self, name: str) -> None:
        _check_name(name)
        if name in self._parameters:
            raise ParameterAlreadyDeclaredError(name)

    def _check_declared(self, parameters: Iterable[Parameter]) -> None:
        if self._allow_undeclared:
            return
        for parameter in parameters:
            if parameter.name not in self._parameters:
                raise ParameterNotDeclaredError(parameter.name)

    def _checked_for_declaration(
        self, name: str, value: ParameterValue, descriptor: ParameterDescriptor
    ) -> Parameter:
        if not descriptor.type.check(value):
            raise InvalidParameterTypeError(name, wrong_type(descriptor.type, value))
        parameter = Parameter(name, descriptor.type, value)
        reason = descriptor.fault(value) or self.callbacks.refusal([parameter])
        if reason:
            raise InvalidParameterValueError(name, value, reason)
        return parameter

    def _store(self, parameter: Parameter) -> None:
        name = parameter.name
        # ROS 2's way to delete a parameter: it is set to a value of no type.
        if parameter.type_ is ParameterType.NOT_SET:
            self._forget(name)
            return
        # Undeclared ones, if the node allows them, may change their type with each set.
        descriptor = self._descriptors.get(name) or ParameterDescriptor(name=name, dynamic_typing=True)
        if descriptor.dynamic_typing:
            descriptor = dataclasses.replace(descriptor, type=parameter.type_)
        self._descriptors[name] = descriptor
        self._parameters[name] = parameter

    def _forget(self, name: str) -> None:
        self._parameters.pop(name, None)
        self._descriptors.pop(name, None)


def _check_name(name: object) -> None:
    if not isinstance(name, str):
        raise TypeError(f"a parameter's name must be a str, not {type(name).__name__}")
    if not name:
        raise InvalidParameterError(name)


def _type_and_value(default: ParameterValue | ParameterType) -> tuple[ParameterType, ParameterValue]:
    if isinstance(default, ParameterType):
        if default is ParameterType.NOT_SET:
            raise ValueError("Cannot declare a statically typed parameter with type NOT_SET")
        return default, None
    return ParameterType.from_parameter_value(default), default
