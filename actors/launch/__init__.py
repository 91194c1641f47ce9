"""Launch files: many nodes with one command.

    from actors.launch import LaunchDescription, Node

    def generate_launch_description():
        return LaunchDescription([Node(package="my_package", executable="talker", namespace="ns1")])

The names below load their modules when they are first used.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from actors.lazy import lazy_names

if TYPE_CHECKING:
    from actors.launch.description.actions import AppendEnvironmentVariable as AppendEnvironmentVariable
    from actors.launch.description.actions import DeclareLaunchArgument as DeclareLaunchArgument
    from actors.launch.description.actions import EmitEvent as EmitEvent
    from actors.launch.description.actions import ExecuteProcess as ExecuteProcess
    from actors.launch.description.actions import GroupAction as GroupAction
    from actors.launch.description.actions import IncludeLaunchDescription as IncludeLaunchDescription
    from actors.launch.description.actions import LogInfo as LogInfo
    from actors.launch.description.actions import Node as Node
    from actors.launch.description.actions import OpaqueFunction as OpaqueFunction
    from actors.launch.description.actions import ParameterValue as ParameterValue
    from actors.launch.description.actions import PushNamespace as PushNamespace
    from actors.launch.description.actions import PushRosNamespace as PushRosNamespace
    from actors.launch.description.actions import RegisterEventHandler as RegisterEventHandler
    from actors.launch.description.actions import SetEnvironmentVariable as SetEnvironmentVariable
    from actors.launch.description.actions import SetLaunchConfiguration as SetLaunchConfiguration
    from actors.launch.description.actions import SetParameter as SetParameter
    from actors.launch.description.actions import SetRemap as SetRemap
    from actors.launch.description.actions import Shutdown as Shutdown
    from actors.launch.description.actions import TimerAction as TimerAction
    from actors.launch.description.actions import UnsetEnvironmentVariable as UnsetEnvironmentVariable
    from actors.launch.description.conditions import IfCondition as IfCondition
    from actors.launch.description.conditions import LaunchConfigurationEquals as LaunchConfigurationEquals
    from actors.launch.description.conditions import (
        LaunchConfigurationNotEquals as LaunchConfigurationNotEquals,
    )
    from actors.launch.description.conditions import UnlessCondition as UnlessCondition
    from actors.launch.description.description import LaunchDescription as LaunchDescription
    from actors.launch.description.description_source import (
        AnyLaunchDescriptionSource as AnyLaunchDescriptionSource,
    )
    from actors.launch.description.description_source import (
        PythonLaunchDescriptionSource as PythonLaunchDescriptionSource,
    )
    from actors.launch.description.event_handlers import OnNodeUp as OnNodeUp
    from actors.launch.description.event_handlers import OnProcessExit as OnProcessExit
    from actors.launch.description.event_handlers import OnProcessIO as OnProcessIO
    from actors.launch.description.event_handlers import OnProcessStart as OnProcessStart
    from actors.launch.description.event_handlers import OnServiceAvailable as OnServiceAvailable
    from actors.launch.description.event_handlers import OnShutdown as OnShutdown
    from actors.launch.description.event_handlers import OnTopicPublished as OnTopicPublished
    from actors.launch.description.library_substitutions import AnonName as AnonName
    from actors.launch.description.library_substitutions import Command as Command
    from actors.launch.description.library_substitutions import FileContent as FileContent
    from actors.launch.description.library_substitutions import FindExecutable as FindExecutable
    from actors.launch.description.library_substitutions import FindPackageShare as FindPackageShare
    from actors.launch.description.logic import AllSubstitution as AllSubstitution
    from actors.launch.description.logic import AndSubstitution as AndSubstitution
    from actors.launch.description.logic import AnySubstitution as AnySubstitution
    from actors.launch.description.logic import BooleanSubstitution as BooleanSubstitution
    from actors.launch.description.logic import EqualsSubstitution as EqualsSubstitution
    from actors.launch.description.logic import IfElseSubstitution as IfElseSubstitution
    from actors.launch.description.logic import NotEqualsSubstitution as NotEqualsSubstitution
    from actors.launch.description.logic import NotSubstitution as NotSubstitution
    from actors.launch.description.logic import OrSubstitution as OrSubstitution
    from actors.launch.description.python_expression import PythonExpression as PythonExpression
    from actors.launch.description.substitutions import EnvironmentVariable as EnvironmentVariable
    from actors.launch.description.substitutions import LaunchConfiguration as LaunchConfiguration
    from actors.launch.description.substitutions import LaunchContext as LaunchContext
    from actors.launch.description.substitutions import PathJoinSubstitution as PathJoinSubstitution
    from actors.launch.description.substitutions import TextSubstitution as TextSubstitution
    from actors.launch.description.substitutions import ThisLaunchFile as ThisLaunchFile
    from actors.launch.description.substitutions import ThisLaunchFileDir as ThisLaunchFileDir
    from actors.launch.errors import LaunchError as LaunchError
    from actors.launch.errors import LaunchFileError as LaunchFileError
    from actors.launch.errors import UnknownArgumentError as UnknownArgumentError
    from actors.launch.launching import Launch as Launch

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "actors.launch.description.event_handlers": (
            "OnNodeUp",
            "OnProcessExit",
            "OnProcessIO",
            "OnProcessStart",
            "OnServiceAvailable",
            "OnShutdown",
            "OnTopicPublished",
        ),
        "actors.launch.description.actions": (
            "AppendEnvironmentVariable",
            "DeclareLaunchArgument",
            "EmitEvent",
            "ExecuteProcess",
            "GroupAction",
            "IncludeLaunchDescription",
            "LogInfo",
            "Node",
            "ParameterValue",
            "PushNamespace",
            "PushRosNamespace",
            "SetEnvironmentVariable",
            "SetLaunchConfiguration",
            "SetParameter",
            "SetRemap",
            "Shutdown",
            "TimerAction",
            "UnsetEnvironmentVariable",
            "OpaqueFunction",
            "RegisterEventHandler",
        ),
        "actors.launch.description.conditions": (
            "IfCondition",
            "LaunchConfigurationEquals",
            "LaunchConfigurationNotEquals",
            "UnlessCondition",
        ),
        "actors.launch.description.description": ("LaunchDescription",),
        "actors.launch.description.description_source": (
            "AnyLaunchDescriptionSource",
            "PythonLaunchDescriptionSource",
        ),
        "actors.launch.errors": (
            "LaunchError",
            "LaunchFileError",
            "UnknownArgumentError",
        ),
        "actors.launch.description.library_substitutions": (
            "AnonName",
            "Command",
            "FileContent",
            "FindExecutable",
            "FindPackageShare",
        ),
        "actors.launch.description.logic": (
            "AllSubstitution",
            "AndSubstitution",
            "AnySubstitution",
            "BooleanSubstitution",
            "EqualsSubstitution",
            "IfElseSubstitution",
            "NotEqualsSubstitution",
            "NotSubstitution",
            "OrSubstitution",
        ),
        "actors.launch.description.python_expression": ("PythonExpression",),
        "actors.launch.launching": ("Launch",),
        "actors.launch.description.substitutions": (
            "EnvironmentVariable",
            "LaunchConfiguration",
            "LaunchContext",
            "PathJoinSubstitution",
            "TextSubstitution",
            "ThisLaunchFile",
            "ThisLaunchFileDir",
        ),
    },
)
