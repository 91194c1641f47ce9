"""Reads and makes point clouds: programs import this package as `sensor_msgs_py`. It needs NumPy."""
