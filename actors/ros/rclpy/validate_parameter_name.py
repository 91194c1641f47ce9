"""Checks names of parameters."""

from __future__ import annotations

from typing import Literal

from actors.ros.rclpy.exceptions import InvalidParameterException


def validate_parameter_name(name: str) -> Literal[True]:
    """Return True; raise InvalidParameterException if the name is empty."""
    if not name:
        raise InvalidParameterException(name)
    return True
