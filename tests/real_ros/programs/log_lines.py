"""Log lines, printed as the environment says: a program of its own."""

from __future__ import annotations

import rclpy


def log() -> None:
    """Log lines of several levels."""
    rclpy.init(args=[])
    logger = rclpy.create_node("probe").get_logger()
    logger.info("started")
    logger.get_child("part").error("two\nlines")
    logger.debug("not shown")
    rclpy.shutdown()


if __name__ == "__main__":
    log()
