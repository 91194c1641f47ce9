"""Two nodes with states, brought up in order: `callboard launch examples/launch/lifecycle.launch.py`.

The first one is configured and activated by itself, and the second one when the first one is active. If the
second one cannot be configured, the launch ends.
"""

from actors.interfaces.lifecycle_msgs.msg import Transition
from actors.launch import (
    ChangeState,
    EmitEvent,
    LaunchDescription,
    LifecycleNode,
    LifecycleTransition,
    OnStateTransition,
    RegisterEventHandler,
    Shutdown,
    matches_action,
)


def generate_launch_description() -> LaunchDescription:
    first = LifecycleNode(script="../lifecycle_talker.py", name="first", namespace="", autostart=True)
    second = LifecycleNode(script="../lifecycle_talker.py", name="second", namespace="")
    configure = ChangeState(
        lifecycle_node_matcher=matches_action(second), transition_id=Transition.TRANSITION_CONFIGURE
    )
    handlers = [
        OnStateTransition(
            target_lifecycle_node=first, goal_state="active", entities=[EmitEvent(event=configure)]
        ),
        OnStateTransition(
            target_lifecycle_node=second,
            start_state="configuring",
            goal_state="inactive",
            entities=[LifecycleTransition(lifecycle_node_names=["second"], transition_ids=["activate"])],
        ),
        OnStateTransition(
            target_lifecycle_node=second,
            start_state="configuring",
            goal_state="unconfigured",
            entities=[Shutdown(reason="the second node cannot be configured")],
        ),
    ]
    return LaunchDescription([*map(RegisterEventHandler, handlers), first, second])
