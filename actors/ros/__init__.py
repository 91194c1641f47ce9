"""ROS 2's Python packages for programs that were written for it, which run unchanged and without ROS.

Such programs are run by `callboard run --ros` or `python -m actors.ros`, or after
`actors.ros.finder.install()`. In `actors`, only `callboard launch --ros` imports this package. `rclpy/` has
the modules that programs import. One thread of the process runs the nodes (`process_thread.py`); callbacks
run in the threads that spin.

Imports `processes/`, `threads/`, `runtime/` and the packages below them.
"""
