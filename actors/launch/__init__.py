"""Launch files: many nodes with one command.

    from actors.launch import LaunchDescription, Node

    def generate_launch_description():
        return LaunchDescription([Node(package="my_package", executable="talker", namespace="ns1")])

`Launch`, which runs a description, is loaded when it is first used.

Imports tools, processes, lifecycle and the packages below them, and broker.
"""

# ruff: noqa: I001 - isort would give each name an import of its own

from __future__ import annotations

from actors.launch.description.actions import (
    AppendEnvironmentVariable as AppendEnvironmentVariable,
    DeclareLaunchArgument as DeclareLaunchArgument,
    EmitEvent as EmitEvent,
    GroupAction as GroupAction,
    IncludeLaunchDescription as IncludeLaunchDescription,
    LogInfo as LogInfo,
    OpaqueFunction as OpaqueFunction,
    PopEnvironment as PopEnvironment,
    PopLaunchConfigurations as PopLaunchConfigurations,
    PushEnvironment as PushEnvironment,
    PushLaunchConfigurations as PushLaunchConfigurations,
    PushNamespace as PushNamespace,
    PushRosNamespace as PushRosNamespace,
    RegisterEventHandler as RegisterEventHandler,
    ResetEnvironment as ResetEnvironment,
    ResetLaunchConfigurations as ResetLaunchConfigurations,
    SetEnvironmentVariable as SetEnvironmentVariable,
    SetLaunchConfiguration as SetLaunchConfiguration,
    SetParameter as SetParameter,
    SetParametersFromFile as SetParametersFromFile,
    SetRemap as SetRemap,
    Shutdown as Shutdown,
    TimerAction as TimerAction,
    UnsetEnvironmentVariable as UnsetEnvironmentVariable,
    UnsetLaunchConfiguration as UnsetLaunchConfiguration,
)
from actors.launch.description.conditions import (
    IfCondition as IfCondition,
    LaunchConfigurationEquals as LaunchConfigurationEquals,
    LaunchConfigurationNotEquals as LaunchConfigurationNotEquals,
    UnlessCondition as UnlessCondition,
)
from actors.launch.description.description import LaunchDescription as LaunchDescription
from actors.launch.description.description_source import (
    AnyLaunchDescriptionSource as AnyLaunchDescriptionSource,
    PythonLaunchDescriptionSource as PythonLaunchDescriptionSource,
)
from actors.launch.description.event_handlers import (
    OnNodeUp as OnNodeUp,
    OnProcessExit as OnProcessExit,
    OnProcessIO as OnProcessIO,
    OnProcessStart as OnProcessStart,
    OnServiceAvailable as OnServiceAvailable,
    OnShutdown as OnShutdown,
    OnStateTransition as OnStateTransition,
    OnTopicPublished as OnTopicPublished,
)
from actors.launch.description.library_substitutions import (
    AnonName as AnonName,
    Command as Command,
    ExecutableInPackage as ExecutableInPackage,
    FileContent as FileContent,
    FindExecutable as FindExecutable,
    FindPackagePrefix as FindPackagePrefix,
    FindPackageShare as FindPackageShare,
    LaunchLogDir as LaunchLogDir,
    Parameter as Parameter,
)
from actors.launch.description.lifecycle import (
    ChangeState as ChangeState,
    LifecycleNode as LifecycleNode,
    LifecycleTransition as LifecycleTransition,
    matches_action as matches_action,
    matches_node_name as matches_node_name,
)
from actors.launch.description.logic import (
    AllSubstitution as AllSubstitution,
    AndSubstitution as AndSubstitution,
    AnySubstitution as AnySubstitution,
    BooleanSubstitution as BooleanSubstitution,
    EqualsSubstitution as EqualsSubstitution,
    IfElseSubstitution as IfElseSubstitution,
    NotEqualsSubstitution as NotEqualsSubstitution,
    NotSubstitution as NotSubstitution,
    OrSubstitution as OrSubstitution,
)
from actors.launch.description.process_actions import (
    ExecuteProcess as ExecuteProcess,
    Node as Node,
    ParameterValue as ParameterValue,
    RosBridge as RosBridge,
)
from actors.launch.description.python_expression import PythonExpression as PythonExpression
from actors.launch.description.substitutions import (
    EnvironmentVariable as EnvironmentVariable,
    LaunchConfiguration as LaunchConfiguration,
    LaunchContext as LaunchContext,
    LocalSubstitution as LocalSubstitution,
    PathJoinSubstitution as PathJoinSubstitution,
    TextSubstitution as TextSubstitution,
    ThisLaunchFile as ThisLaunchFile,
    ThisLaunchFileDir as ThisLaunchFileDir,
)
from actors.launch.description.templates import ParameterFile as ParameterFile
from actors.launch.errors import (
    LaunchError as LaunchError,
    LaunchFileError as LaunchFileError,
    UnknownArgumentError as UnknownArgumentError,
)
from actors.lazy import lazy_imports

with lazy_imports(__name__):
    from actors.launch.launching import Launch as Launch
