"""`python -m actors.ros`: run a program that was written for ROS 2."""

from __future__ import annotations

import signal
import sys
from argparse import REMAINDER, ArgumentParser
from typing import TYPE_CHECKING

# The other imports are in functions, where Ctrl-C ends the command without a traceback.
# ruff: noqa: PLC0415

if TYPE_CHECKING:
    from collections.abc import Callable

USAGE_ERROR = 2


def _parser() -> ArgumentParser:
    parser = ArgumentParser(
        prog="python -m actors.ros", description="Run a program for ROS 2, with callboard in place of rclpy."
    )
    parser.add_argument("--force", action="store_true", help="run it even if ROS 2's own rclpy is installed")
    parser.add_argument("--no-broker", action="store_true", help="start no broker, even if none answers")
    parser.add_argument("-m", dest="module", action="store_true", help="the program is the name of a module")
    parser.add_argument(
        "program", metavar="SCRIPT | PACKAGE EXECUTABLE", help="a file, or a package and its console script"
    )
    parser.add_argument("arguments", nargs=REMAINDER, help="arguments of the program")
    return parser


def main() -> None:
    """Run the program that the command line names in this process; start a broker if none answers."""
    try:
        program = _prepare()
    except KeyboardInterrupt:
        raise SystemExit(128 + signal.SIGINT) from None
    from proto.aio.process import configure_process

    configure_process()  # the process is the program's own: large messages take half of the time then
    program()


def _prepare() -> Callable[[], object]:
    from actors.processes.local_broker import BrokerStartError
    from actors.ros.finder import RealPackageError, install
    from actors.ros.program import find_program
    from actors.tools.programs import NoProgramError
    from proto.errors import CallboardError

    options = _parser().parse_args()
    try:
        install(force=options.force)
        program = find_program(options.program, options.arguments, module=options.module)
        if not options.no_broker:
            _ensure_broker()
    except (RealPackageError, NoProgramError, CallboardError) as error:
        print(error, file=sys.stderr)  # noqa: T201 - a command
        raise SystemExit(1 if isinstance(error, BrokerStartError) else USAGE_ERROR) from None
    return program


def _ensure_broker() -> None:
    from actors.config.contexts import find_broker_target
    from actors.config.environment import domain_id
    from actors.processes.local_broker import ensure_local_broker, keep_local_broker

    target = find_broker_target(domain=domain_id(ros=True))
    started = ensure_local_broker(target)
    if started is not None:
        print(started, file=sys.stderr, flush=True)  # noqa: T201 - a command
    keep_local_broker(target)


if __name__ == "__main__":
    main()
