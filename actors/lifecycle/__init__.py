"""Nodes with states: ROS 2's managed nodes, which are configured, activated and shut down from outside.

Imports `node/` and the packages below it.
"""
