"""callboard's parameters, under rclpy's names."""

from __future__ import annotations

from actors.parameters.types import Parameter as Parameter
from actors.parameters.types import parameter_value_to_python as parameter_value_to_python

PARAMETER_SEPARATOR_STRING = "."
