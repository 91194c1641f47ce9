"""rclpy's loggers on top of the standard `logging` module.

Imports nothing of callboard.
"""
