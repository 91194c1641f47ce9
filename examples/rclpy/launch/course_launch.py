"""The publishers, the subscriber and the server in one namespace. Written for launch_ros.

Run it with `callboard launch --ros course_package course_launch.py`.
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

PROGRAMS = ("minimal_publisher", "minimal_subscriber", "publishing_subscriber", "add_two_ints_server")


def generate_launch_description():
    namespace = LaunchConfiguration("namespace")
    return LaunchDescription(
        [
            DeclareLaunchArgument("namespace", default_value="ns1", description="namespace of the nodes"),
            *(
                Node(package="course_package", executable=program, namespace=namespace, output="screen")
                for program in PROGRAMS
            ),
        ]
    )
