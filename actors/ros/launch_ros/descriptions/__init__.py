"""Descriptions of parameters, and of components, which callboard does not have."""

from __future__ import annotations

from actors.ros.launch_ros.parameter_descriptions import (
    Parameter as Parameter,
    ParameterFile as ParameterFile,
    ParameterValue as ParameterValue,
)


class ComposableNode:
    """A component. It can be described; the actions that would load it say what to do instead."""

    def __init__(self, *_args: object, **_kwargs: object) -> None:
        pass


ComposableLifecycleNode = ComposableNode
