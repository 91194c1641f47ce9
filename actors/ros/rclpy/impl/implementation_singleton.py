"""Cannot be imported: rclpy's is its C library, which callboard does not have."""

raise ImportError(
    "rclpy.impl.implementation_singleton gives access to rclpy's C library, which callboard does not have:"
    " use the classes of rclpy.node and its other modules instead"
)
