"""`python -m actors.ros`: run a program that was written for ROS 2."""

from __future__ import annotations

import sys
from argparse import REMAINDER, ArgumentParser

from actors.ros.finder import RealPackageError, install
from actors.ros.program import NoProgramError, run_program

USAGE_ERROR = 2


def main() -> None:
    """Run the program of the command line in this process."""
    parser = ArgumentParser(
        prog="python -m actors.ros", description="Run a program for ROS 2, with callboard in place of rclpy."
    )
    parser.add_argument("--force", action="store_true", help="even if ROS 2's own rclpy is installed")
    parser.add_argument("program", metavar="SCRIPT | PACKAGE EXECUTABLE", help="a file, or a console script")
    parser.add_argument("arguments", nargs=REMAINDER, help="for the program")
    options = parser.parse_args()
    try:
        install(force=options.force)
        run_program(options.program, options.arguments)
    except (RealPackageError, NoProgramError) as error:
        print(error, file=sys.stderr)  # noqa: T201 - a command
        raise SystemExit(USAGE_ERROR) from None


if __name__ == "__main__":
    main()
