"""The bridge between callboard and real ROS 2, each item in each direction.

Real ROS 2 is in build/ros2 (`make test` builds it), as for `tests/real_ros`, and its processes answer
questions in the same way: `programs/` has what they can be asked. A pytest worker has one bridge, one broker
and one ROS process for most of its tests; each test has names of its own. Tests of a bridge with options, or
that end one, start their own.
"""
