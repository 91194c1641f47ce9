"""Points and spans of time with rclpy's types, clocks, and simulated time.

Imports only interfaces and errors.
"""
