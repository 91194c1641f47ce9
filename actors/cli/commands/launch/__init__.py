"""`callboard launch`."""

from __future__ import annotations

import argparse
from typing import Any, Final

from actors.cli.parsing import Options, Parser, add_broker_options, positive

EXAMPLES: Final = {
    "callboard launch robot.py": "what it describes, until Ctrl-C; with a broker if there is none",
    "callboard launch my_package robot.py speed:=1.5": "a file of an installed package, with an argument",
    "callboard launch --ros py_pubsub pubsub_launch.py": "a file written for ROS 2, without ROS",
    "callboard launch robot.py --show-args": "which arguments there are",
    "callboard launch robot.py --watch": "the same while you write it: what is saved runs again",
    "callboard launch robot.py --web": "the same with the page in a browser",
    "callboard launch robot.py --dry-run": "what it would start, as commands",
    "callboard launch robot.py --output both": "lines to the screen and to log files",
    "callboard launch robot.py --json | jq .event": "what happens, for programs",
}


class _OptionName(argparse.Action):
    """Stores the name by which an option was given."""

    def __call__(
        self, _parser: argparse.ArgumentParser, options: Options, _values: Any, name: str | None = None
    ) -> None:
        """Store the name."""
        setattr(options, self.dest, name)


class _PrintSchema(argparse.Action):
    """Prints the schema and ends, as --help does its text."""

    def __call__(self, parser: argparse.ArgumentParser, *args: Any) -> None:
        """Print the schema and end the process."""
        del args
        from actors.launch.documents.schema import schema_text

        print(schema_text(), end="")
        parser.exit()


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    parser.add_argument(
        "file", metavar="FILE", help="a Python, YAML, TOML or XML file; or a package, and one of its files"
    )
    parser.add_argument(
        "arguments",
        metavar="NAME:=VALUE",
        nargs="*",
        default=[],
        help="arguments of the launch file; of two values for one name the last counts",
    )
    mode = parser.add_mutually_exclusive_group()
    mode.add_argument(
        *("-s", "--show-args", "--show-arguments"), action="store_true", help="print the arguments and end"
    )
    mode.add_argument(
        *("-p", "--print", "--print-description"),
        dest="print_description",
        action="store_true",
        help="print the actions and end",
    )
    mode.add_argument("--dry-run", action="store_true", help="print what it would start, and end")
    mode.add_argument("--json", action="store_true", help="print all that happens as JSON, an object a line")
    mode.add_argument(
        "--schema",
        nargs=0,
        action=_PrintSchema,
        help="print the JSON schema of YAML and TOML files, for editors, and end; needs no FILE",
    )
    _add_ros_options(parser)
    parser.add_argument(
        "--stop-timeout",
        type=positive,
        metavar="SEC",
        help="what a process gets after SIGINT, and again after SIGTERM; default: 5",
    )
    parser.add_flag("--ros", help="let the file and its programs import ROS 2's names from callboard")
    parser.add_flag("--force", help="with --ros: even if ROS 2's own rclpy is installed")
    parser.add_flag("--watch", help="start processes again when their source changes")
    parser.add_flag("--web", help="also serve the page, until Ctrl-C")
    add_broker_options(parser)


def _add_ros_options(parser: Parser) -> None:
    """Add the options of `ros2 launch` that say how the launch runs."""
    output = parser.add_mutually_exclusive_group()
    output.add_argument(
        "--output",
        choices=("screen", "log", "both"),
        help="where the lines of all processes go, whatever the file says; with log, those of stderr to the "
        "screen, too",
    )
    output.add_argument(
        *("-a", "--show-all-subprocesses-output"),
        dest="output",
        action="store_const",
        const="both",
        help="the same as --output both",
    )
    parser.add_argument(
        "--launch-prefix",
        metavar="COMMAND",
        help="what to start processes with that have no prefix of their own, such as 'gdb -ex run --args'",
    )
    parser.add_argument(
        "--launch-prefix-filter",
        metavar="PATTERN",
        help="only if the program's name begins with a match of this regular expression",
    )
    parser.add_argument(
        *("-n", "--noninteractive"),
        nargs=0,
        default="",
        action=_OptionName,
        help="draw no status line, also on a terminal",
    )
    parser.add_flag("-d", "--debug", help="also log what is for debugging, and show tracebacks of errors")


def run(options: Options) -> int:
    """Run it."""
    from actors.cli.commands.launch import execution

    return execution.run(options)
