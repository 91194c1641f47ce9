"""The course's five programs with one command: `callboard launch examples/launch/course.launch.py`.

`course.launch.yaml` and `course.launch.toml` say the same. Ctrl-C stops all of it.
"""

from actors.launch import (
    DeclareLaunchArgument,
    GroupAction,
    LaunchConfiguration,
    LaunchDescription,
    Node,
    PushNamespace,
)


def generate_launch_description() -> LaunchDescription:
    talk = [
        Node(script="../minimal_publisher.py"),
        Node(script="../minimal_subscriber.py"),
        Node(script="../publishing_subscriber.py", name="echo", remappings=[("addison2", "echoed")]),
    ]
    add = [
        Node(script="../add_two_ints_server.py", respawn=True),
        Node(
            script="../add_two_ints_client.py",
            arguments=[LaunchConfiguration("a"), LaunchConfiguration("b")],
            depends_on=["service add_two_ints"],
        ),
    ]
    return LaunchDescription(
        [
            DeclareLaunchArgument("namespace", default_value="course", description="where the nodes are"),
            DeclareLaunchArgument("a", default_value="5", description="what to add"),
            DeclareLaunchArgument("b", default_value="3", description="what to add to it"),
            GroupAction([PushNamespace(LaunchConfiguration("namespace")), *talk, *add]),
        ]
    )
