"""`python -m actors.ros`: run a program that was written for ROS 2."""

from __future__ import annotations

import sys
from argparse import REMAINDER, ArgumentParser

from actors.config.contexts import find_broker_target
from actors.processes.local_broker import BrokerStartError, ensure_local_broker
from actors.ros.finder import RealPackageError, install
from actors.ros.program import NoProgramError, find_program
from proto.errors import CallboardError

USAGE_ERROR = 2


def _parser() -> ArgumentParser:
    parser = ArgumentParser(
        prog="python -m actors.ros", description="Run a program for ROS 2, with callboard in place of rclpy."
    )
    parser.add_argument("--force", action="store_true", help="even if ROS 2's own rclpy is installed")
    parser.add_argument("--no-broker", action="store_true", help="start no broker, even if none answers")
    parser.add_argument("-m", dest="module", action="store_true", help="the program is the name of a module")
    parser.add_argument("program", metavar="SCRIPT | PACKAGE EXECUTABLE", help="a file, or a console script")
    parser.add_argument("arguments", nargs=REMAINDER, help="for the program")
    return parser


def main() -> None:
    """Run the program of the command line in this process, with a broker if none answers."""
    options = _parser().parse_args()
    try:
        install(force=options.force)
        program = find_program(options.program, options.arguments, module=options.module)
        if not options.no_broker:
            _ensure_broker()
    except (RealPackageError, NoProgramError, CallboardError) as error:
        print(error, file=sys.stderr)  # noqa: T201 - a command
        raise SystemExit(1 if isinstance(error, BrokerStartError) else USAGE_ERROR) from None
    program()


def _ensure_broker() -> None:
    started = ensure_local_broker(find_broker_target())
    if started is not None:
        print(started, file=sys.stderr, flush=True)  # noqa: T201 - a command


if __name__ == "__main__":
    main()
