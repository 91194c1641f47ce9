"""rclpy's names for programs that were written for ROS 2: they run unchanged, without ROS.

Nothing else in `actors` imports it: programs run so by `callboard run --ros` or `python -m actors.ros`, or
after `actors.ros.finder.install()`. `rclpy/` has the modules that they import; one thread of the process runs
the nodes (`process_thread.py`), and callbacks run in the threads that spin.

Imports `processes/`, `threads/`, `runtime/` and the packages below them.
"""
