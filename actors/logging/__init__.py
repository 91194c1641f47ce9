"""rclpy's loggers on top of the standard `logging` module.

Imports config for colours, and no other package of `actors`.
"""
