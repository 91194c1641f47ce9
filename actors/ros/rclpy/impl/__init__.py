"""The parts of rclpy's internals that programs import."""
