"""Points and spans of time with rclpy's types, and the clock.

Plain data: imports interfaces only.
"""
