"""rclpy's parameter methods: a part of Node."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from actors.parameters.callbacks import OnSetCallback, PostSetCallback, PreSetCallback
    from actors.parameters.store import ParameterStore
    from actors.parameters.types import (
        ListParametersResult,
        Parameter,
        ParameterDescriptor,
        ParameterType,
        ParameterValue,
        SetParametersResult,
    )


class NodeParameters:
    """A node's parameters, under rclpy's names. What they do and raise is told in `ParameterStore`."""

    _parameters: ParameterStore

    def declare_parameter(
        self,
        name: str,
        value: ParameterValue | ParameterType = None,
        descriptor: ParameterDescriptor | None = None,
        ignore_override: bool = False,  # noqa: FBT001, FBT002 - rclpy's order
    ) -> Parameter:
        """Declare a parameter; an override from the command line, a file or the constructor wins."""
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
        """Declare several parameters below a namespace."""
        return self._parameters.declare_many(namespace, parameters, ignore_override=ignore_override)

    def undeclare_parameter(self, name: str) -> None:
        """Forget a parameter."""
        self._parameters.undeclare(name)

    def has_parameter(self, name: str) -> bool:
        """Tell whether a parameter is declared."""
        return self._parameters.has(name)

    def get_parameter(self, name: str) -> Parameter:
        """Return a parameter; its value is `.value`."""
        return self._parameters.get(name)

    def get_parameters(self, names: Sequence[str]) -> list[Parameter]:
        """Return several parameters."""
        return [self._parameters.get(name) for name in names]

    def get_parameter_or(self, name: str, alternative_value: Parameter | None = None) -> Parameter:
        """Return a parameter, or the alternative if it is not declared."""
        return self._parameters.get_or(name, alternative_value)

    def get_parameters_by_prefix(self, prefix: str) -> dict[str, Parameter]:
        """Return the parameters below a prefix, without it."""
        return self._parameters.get_by_prefix(prefix)

    def set_parameters(self, parameter_list: Sequence[Parameter]) -> list[SetParametersResult]:
        """Set parameters one by one; each has its own result."""
        return self._parameters.set(parameter_list)

    def set_parameters_atomically(self, parameter_list: Sequence[Parameter]) -> SetParametersResult:
        """Set all of the parameters, or none."""
        return self._parameters.set_atomically(parameter_list)

    def list_parameters(self, prefixes: Sequence[str], depth: int) -> ListParametersResult:
        """List names below prefixes, `depth` levels deep (0: all)."""
        return self._parameters.list_names(prefixes, depth)

    def describe_parameter(self, name: str) -> ParameterDescriptor:
        """Return what is allowed for a parameter."""
        return self._parameters.describe(name)

    def add_pre_set_parameters_callback(self, callback: PreSetCallback) -> None:
        """Let `callback` change what is about to be set."""
        self._parameters.callbacks.add_pre_set(callback)

    def add_on_set_parameters_callback(self, callback: OnSetCallback) -> None:
        """Let `callback` accept or refuse what is about to be set."""
        self._parameters.callbacks.add_on_set(callback)

    def add_post_set_parameters_callback(self, callback: PostSetCallback) -> None:
        """Tell `callback` what has been set."""
        self._parameters.callbacks.add_post_set(callback)
