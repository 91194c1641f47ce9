"""The parameters of one node: what is declared, what may be set, and who is asked or told."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Final, Protocol

from actors.parameters.errors import (
    InvalidParameterError,
    InvalidParameterTypeError,
    InvalidParameterValueError,
    ParameterAlreadyDeclaredError,
    ParameterImmutableError,
    ParameterNotDeclaredError,
    ParameterUninitializedError,
)
from actors.parameters.types import (
    ListParametersResult,
    Parameter,
    ParameterDescriptor,
    ParameterType,
    SetParametersResult,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from actors.parameters.types import ParameterValue

__all__ = ["ListParametersResult", "ParameterStore", "SetParametersOutcome", "SetParametersResult"]

SEPARATOR: Final = "."
"""Between the levels of a parameter's name."""


class SetParametersOutcome(Protocol):
    """What an on-set callback returns: `SetParametersResult`, or a message with the same fields."""

    @property
    def successful(self) -> bool:
        """Whether the values may be set."""
        ...

    @property
    def reason(self) -> str:
        """Why not."""
        ...


if TYPE_CHECKING:
    PreSetCallback = Callable[[list[Parameter]], list[Parameter]]
    """Gets what is about to be set, and returns what shall be set instead; nothing refuses it all."""
    OnSetCallback = Callable[[list[Parameter]], SetParametersOutcome]
    """Gets checked values before they are set, and accepts or refuses them all."""
    PostSetCallback = Callable[[list[Parameter]], None]
    """Gets the values that have been set."""


class ParameterStore:
    """All parameters of one node. Nothing here does any I/O.

    `use_sim_time` and `start_type_description_service` are always declared.

    Args:
        overrides: Values from the node's constructor, by name; they go before all others.
        argument_overrides: Values from the command line and its files.
        allow_undeclared: Reading an undeclared parameter gives one without a value, setting it declares it.
        declare_overrides: Declare every override at once.

    Raises:
        InvalidParameterTypeError: An override of an always-declared parameter has another type.
    """

    def __init__(
        self,
        *,
        overrides: Mapping[str, ParameterValue] | None = None,
        argument_overrides: Mapping[str, ParameterValue] | None = None,
        allow_undeclared: bool = False,
        declare_overrides: bool = False,
    ) -> None:
        self._overrides: dict[str, ParameterValue] = {**(argument_overrides or {}), **(overrides or {})}
        self._allow_undeclared = allow_undeclared
        self._parameters: dict[str, Parameter] = {}
        self._descriptors: dict[str, ParameterDescriptor] = {}
        self._pre_set: list[PreSetCallback] = []
        self._on_set: list[OnSetCallback] = []
        self._post_set: list[PostSetCallback] = []
        self.declare("use_sim_time", default=False)
        fixed = ParameterDescriptor(
            description="If enabled, start the type description service.", read_only=True
        )
        self.declare("start_type_description_service", default=True, descriptor=fixed)
        if declare_overrides:
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

        The type is fixed from then on, unless the descriptor says `dynamic_typing`, or there is neither a
        default nor a type.

        Args:
            name: Not empty.
            default: Its value, or only its type: then it has no value until an override or a set gives one.
            descriptor: What is allowed; `name` and `type` in it are filled in.
            ignore_override: Take the default in any case.

        Raises:
            TypeError: The name is no str, or no parameter can hold the value.
            InvalidParameterError: The name is empty.
            ParameterAlreadyDeclaredError: It is declared.
            InvalidParameterTypeError: The override has another type than the default.
            InvalidParameterValueError: A range or an on-set callback refuses the value.
        """
        self._check_new_name(name)
        descriptor = descriptor or ParameterDescriptor()
        kind, value = _type_and_value(default)
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
        self._descriptors[name] = descriptor
        self._parameters[name] = parameter
        if value is not None:
            self._tell([parameter])
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
        """Declare several parameters as `declare` does; `namespace` and a dot stand before their names.

        All names are checked before the first is declared; a wrong value leaves the ones before it declared.
        """
        prefix = f"{namespace}{SEPARATOR}" if namespace else ""
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
        for item in wanted:
            name, *rest = item
            declared.append(self.declare(prefix + name, *rest, ignore_override=ignore_override))  # pyright: ignore[reportArgumentType]
        return declared

    def undeclare(self, name: str) -> None:
        """Forget a parameter.

        Raises:
            ParameterNotDeclaredError: It is not declared.
            ParameterImmutableError: It is read only.
        """
        if self.describe(name).read_only:
            raise ParameterImmutableError(name)
        self._forget(name)

    def has(self, name: str) -> bool:
        """Tell whether a parameter is declared."""
        return name in self._parameters

    def get(self, name: str) -> Parameter:
        """Return a parameter.

        Raises:
            ParameterNotDeclaredError: It is not declared, and undeclared ones are not allowed.
            ParameterUninitializedError: It was declared with a type only, and has no value yet.
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
        """Return the parameters below a prefix by the rest of their names; all of them for an empty one."""
        start = f"{prefix}{SEPARATOR}" if prefix else ""
        found = self._parameters.items()
        return {name.removeprefix(start): each for name, each in found if name.startswith(start)}

    def list_names(self, prefixes: Sequence[str] = (), depth: int = 0) -> ListParametersResult:
        """List names, of all parameters or of those at and below the prefixes.

        Args:
            prefixes: Without the dot at their end.
            depth: How many levels below each prefix; 0 for all.

        Raises:
            TypeError: `prefixes` is a str.
            ValueError: `depth` is negative.
        """
        if isinstance(prefixes, str):
            raise TypeError("prefixes must be a sequence of str, not a str")
        if depth < 0:
            raise ValueError("depth must not be negative")
        names = [name for name in self._parameters if _is_listed(name, prefixes, depth)]
        parents = (name.rpartition(SEPARATOR)[0] for name in names)
        return ListParametersResult(names, [*dict.fromkeys(filter(None, parents))])

    def describe(self, name: str) -> ParameterDescriptor:
        """Return what is allowed and said about a parameter.

        Raises:
            ParameterNotDeclaredError: It is not declared.
        """
        try:
            return self._descriptors[name]
        except KeyError:
            raise ParameterNotDeclaredError(name) from None

    def set(self, parameters: Sequence[Parameter]) -> list[SetParametersResult]:
        """Set parameters one by one; a refused one does not stop those after it.

        Returns:
            One result for each, in order.

        Raises:
            ParameterNotDeclaredError: One is not declared; then none is set.
        """
        self._check_declared(parameters)
        return [self.set_atomically([parameter]) for parameter in parameters]

    def set_atomically(self, parameters: Sequence[Parameter]) -> SetParametersResult:
        """Set all of these parameters, or none.

        Raises:
            ParameterNotDeclaredError: One is not declared; then none is set.
        """
        self._check_declared(parameters)
        wanted = [*parameters]
        for pre_set in self._pre_set:
            wanted = pre_set(wanted)
            if not wanted:
                return SetParametersResult(
                    successful=False, reason="a pre-set callback returned no parameters"
                )
        self._check_declared(wanted)
        for parameter in wanted:
            if reason := self._refusal(parameter):
                return SetParametersResult(successful=False, reason=reason)
        refusal = self._ask(wanted)
        if refusal is not None:
            return SetParametersResult(successful=False, reason=refusal)
        for parameter in wanted:
            self._store(parameter)
        self._tell(wanted)
        return SetParametersResult(successful=True)

    def add_pre_set_callback(self, callback: PreSetCallback) -> None:
        """Have a callback change what is about to be set. The last one added is called first."""
        self._pre_set.insert(0, callback)

    def add_on_set_callback(self, callback: OnSetCallback) -> None:
        """Have a callback accept or refuse values. The last one added is called first."""
        self._on_set.insert(0, callback)

    def add_post_set_callback(self, callback: PostSetCallback) -> None:
        """Have a callback told of values that have been set. The last one added is called first."""
        self._post_set.insert(0, callback)

    def remove_callback(self, callback: PreSetCallback | OnSetCallback | PostSetCallback) -> None:
        """Forget a callback of any of the three kinds; `ValueError` if it is not known."""
        for callbacks in (self._pre_set, self._on_set, self._post_set):
            if callback in callbacks:
                callbacks.remove(callback)  # type: ignore[arg-type] # pyright: ignore[reportArgumentType]
                return
        raise ValueError("the callback is not registered")

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
            raise InvalidParameterTypeError(name, _wrong_type(descriptor.type, value))
        parameter = Parameter(name, descriptor.type, value)
        reason = descriptor.fault(value) or self._ask([parameter])
        if reason:
            raise InvalidParameterValueError(name, value, reason)
        return parameter

    def _refusal(self, parameter: Parameter) -> str:
        descriptor = self._descriptors.get(parameter.name)
        if descriptor is None:
            return ""
        if descriptor.read_only:
            return "Trying to set a read-only parameter"
        if not descriptor.dynamic_typing:
            if parameter.type_ is ParameterType.NOT_SET:
                return "Static parameter cannot be undeclared"
            if not descriptor.type.check(parameter.value):
                return _wrong_type(descriptor.type, parameter.value)
        return descriptor.fault(parameter.value)

    def _ask(self, parameters: list[Parameter]) -> str | None:
        """Return why a callback refuses the values, None if none does."""
        for callback in self._on_set:
            outcome = callback(parameters)
            if not outcome.successful:
                return outcome.reason or "an on-set callback refused it"
        return None

    def _tell(self, parameters: list[Parameter]) -> None:
        for callback in self._post_set:
            callback(parameters)

    def _store(self, parameter: Parameter) -> None:
        name = parameter.name
        if parameter.type_ is ParameterType.NOT_SET:
            self._forget(name)
            return
        descriptor = self._descriptors.get(name) or ParameterDescriptor(name=name, dynamic_typing=True)
        if descriptor.dynamic_typing:
            descriptor = dataclasses.replace(descriptor, type=parameter.type_)
        self._descriptors[name] = descriptor
        self._parameters[name] = Parameter(name, descriptor.type, parameter.value)

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


def _wrong_type(expected: ParameterType, value: ParameterValue) -> str:
    got = ParameterType.from_parameter_value(value)
    hint = f" (write {value}.0)" if expected is ParameterType.DOUBLE and got is ParameterType.INTEGER else ""
    return f"Wrong parameter type, expected {expected.name} got {got.name}{hint}"


def _is_listed(name: str, prefixes: Sequence[str], depth: int) -> bool:
    if not prefixes:
        return not depth or name.count(SEPARATOR) < depth
    for prefix in prefixes:
        if name == prefix:
            return True
        start = prefix + SEPARATOR
        if name.startswith(start) and (not depth or name[len(start) :].count(SEPARATOR) < depth):
            return True
    return False
