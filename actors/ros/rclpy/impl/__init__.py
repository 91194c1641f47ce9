"""Of rclpy's internals, what programs import."""
