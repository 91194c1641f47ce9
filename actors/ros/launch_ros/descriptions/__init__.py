"""Descriptions of parameters."""

from __future__ import annotations

from actors.ros.launch.unsupported import unsupported
from actors.ros.launch_ros.parameter_descriptions import (
    Parameter as Parameter,
    ParameterFile as ParameterFile,
    ParameterValue as ParameterValue,
)

ComposableNode = unsupported("ComposableNode", "components are C++ libraries; start each node with Node")
