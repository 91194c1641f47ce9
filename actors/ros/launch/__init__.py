"""`launch` for launch files written for ROS 2: the classes of `actors.launch`, with ROS 2's arguments.

`LaunchService` runs descriptions from programs.

Imports `actors.launch` and what is below it.
"""

from __future__ import annotations

from actors.launch import LaunchFileError
from actors.launch.description.substitutions import Substitution as Substitution
from actors.launch.planning.events import Event as Event
from actors.ros.launch import (
    actions as actions,
    conditions as conditions,
    descriptions as descriptions,
    event_handlers as event_handlers,
    events as events,
    launch_description_sources as launch_description_sources,
    logging as logging,
    substitutions as substitutions,
    utilities as utilities,
)
from actors.ros.launch.context import LaunchContext as LaunchContext
from actors.ros.launch.description import (
    Action as Action,
    Condition as Condition,
    LaunchDescription as LaunchDescription,
    LaunchDescriptionEntity as LaunchDescriptionEntity,
    LaunchDescriptionSource as LaunchDescriptionSource,
    LaunchIntrospector as LaunchIntrospector,
    SomeEntitiesType as SomeEntitiesType,
    SomeSubstitutionsType as SomeSubstitutionsType,
)
from actors.ros.launch.event_handlers import EventHandler as EventHandler
from actors.ros.launch.service import LaunchService as LaunchService

InvalidLaunchFileError = LaunchFileError
