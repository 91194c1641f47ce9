"""The course's five programs with one command: `callboard launch examples/launch/course.launch.py`.

`course.launch.yaml` and `course.launch.toml` are equivalent. Ctrl-C stops all programs.
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
            DeclareLaunchArgument("namespace", default_value="course", description="namespace of the nodes"),
            DeclareLaunchArgument("a", default_value="5", description="first number"),
            DeclareLaunchArgument("b", default_value="3", description="second number"),
            GroupAction([PushNamespace(LaunchConfiguration("namespace")), *talk, *add]),
        ]
    )
