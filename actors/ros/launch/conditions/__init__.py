"""Conditions."""

from __future__ import annotations

from typing import TYPE_CHECKING

from actors.launch import (
    IfCondition as IfCondition,
    LaunchConfigurationEquals as LaunchConfigurationEquals,
    LaunchConfigurationNotEquals as LaunchConfigurationNotEquals,
    LaunchError,
    UnlessCondition as UnlessCondition,
)
from actors.launch.description.conditions import evaluate_condition

if TYPE_CHECKING:
    from actors.launch.description.substitutions import LaunchContext, Text


InvalidConditionExpressionError = LaunchError


def evaluate_condition_expression(context: LaunchContext, expression: Text) -> bool:
    """Return whether a string means true.

    Raises:
        InvalidConditionExpressionError: It means neither true nor false.
    """
    return evaluate_condition(expression, context)
