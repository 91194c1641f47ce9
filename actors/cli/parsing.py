"""Argument parsing: one-line errors with a remedy, and the options that verbs share."""

from __future__ import annotations

import argparse
import math
import re
import sys
from typing import TYPE_CHECKING, Any, Final, NoReturn

from actors.cli.errors import USAGE
from actors.cli.table import load
from actors.cli.terminal import columns
from actors.config import environment
from actors.tools.suggestions import did_you_mean
from proto.limits import MAX_DOMAIN

if TYPE_CHECKING:
    from actors.cli.table import Verb

SHOWN_LENGTH: Final = 128
"""Characters or elements printed of a string or sequence, as in ROS 2."""
QOS_PRESETS: Final = (
    *("unknown", "default", "system_default", "sensor_data", "services_default", "parameters"),
    *("parameter_events", "action_status_default", "best_available", "rosout_default"),
)
"""The presets of actors.qos.profile.QoSPresetProfiles, which importing would cost every verb."""
QOS_POLICIES: Final = {
    "history": ("system_default", "keep_last", "keep_all", "unknown"),
    "reliability": ("system_default", "reliable", "best_effort", "unknown", "best_available"),
    "durability": ("system_default", "transient_local", "volatile", "unknown", "best_available"),
    "liveliness": ("system_default", "automatic", "manual_by_topic", "unknown", "best_available"),
}
"""The values of its policies."""
LOG_LEVELS: Final = tuple(each.lower() for each in environment.LOG_LEVELS)
IGNORED: Final = "accepted for ROS 2's sake:"
"""How the help of an option begins that changes nothing."""
_CHOICE: Final = re.compile(r"argument (\S+): invalid choice: '(.*)' \(choose from (.*)\)", re.DOTALL)


Options = argparse.Namespace
"""A parsed command line."""


class Parser(argparse.ArgumentParser):
    """An argparse parser with one-line errors. Options cannot be abbreviated."""

    def __init__(self, **options: Any) -> None:
        options.setdefault("allow_abbrev", False)
        super().__init__(**options)

    def parse_args(self, args: Any = None, namespace: Any = None) -> Any:  # pyright: ignore[reportIncompatibleMethodOverride]
        """Parse a command line; options may be between arguments."""
        if any(action.nargs in {argparse.REMAINDER, argparse.PARSER} for action in self._actions):
            return super().parse_args(args, namespace)
        found, rest = self.parse_known_intermixed_args(args, namespace)
        if rest:
            # argparse reports everything after an unknown option as unknown, too.
            unknown = [each for each in rest if each.startswith("-")] or rest
            self.error(f"unrecognized arguments: {' '.join(unknown)}")
        return found

    def add_flag(self, *names: str, help: str) -> None:  # noqa: A002 - argparse's name
        """Add an option without a value."""
        self.add_argument(*names, action="store_true", help=help)

    def error(self, message: str) -> NoReturn:
        """Print the text with a remedy, and exit with 2."""
        wrong = _CHOICE.fullmatch(message)
        if wrong is not None:
            where, word, listed = wrong.groups()
            choices = re.findall(r"[\w-]+", listed)
            message = (
                f"no {where} '{word}'{did_you_mean(word, choices) or '; there is ' + ', '.join(choices)}"
            )
        else:
            message = f"{message}; see {self.prog} --help"
        self.exit(USAGE, f"{self.prog}: {message}\n")

    def _print_message(self, message: str, file: Any = None) -> None:
        # argparse would swallow a broken pipe.
        (file or sys.stderr).write(message)


class _Help(argparse.RawDescriptionHelpFormatter):
    """A formatter as wide as the terminal. argparse's own imports shutil, even without --help."""

    def __init__(self, prog: str, **options: Any) -> None:
        options.setdefault("width", columns() - 2)
        super().__init__(prog, **options)


def parser_of(command: str, verb: Verb) -> Parser:
    """Return the parser of a verb, such as "topic list"."""
    module = load(command)
    examples = [f"  {line}\n      {what}" for line, what in module.EXAMPLES.items()]
    summary = f"{verb.summary[0].upper()}{verb.summary[1:]}."
    further = [f"  callboard {command} {name}\n      {each.summary}" for name, each in verb.verbs.items()]
    parser = Parser(
        prog=f"callboard {command}",
        description=summary,
        epilog="\n".join([*(["verbs:", *further, ""] if further else ()), "examples:", *examples]),
        formatter_class=_Help,
    )
    module.add_arguments(parser)
    return parser


def add_broker_options(parser: Parser) -> None:
    """Add --url, --domain and --context."""
    parser.add_argument(
        "--url",
        metavar="URL",
        help="the broker; default: CALLBOARD_URL, then the context's, then callboard://127.0.0.1:7411",
    )
    parser.add_argument(
        "--domain",
        type=domain,
        metavar="N",
        help=f"the domain id, 0 to {MAX_DOMAIN}; default: CALLBOARD_DOMAIN, then the context's, then 0",
    )
    parser.add_argument(
        "--context",
        metavar="CONTEXT",
        help="a broker named with `callboard context add`; default: CALLBOARD_CONTEXT, then the current one",
    )


def add_ros_options(parser: Parser, *, daemon: bool = True, clock: str = "") -> None:
    """Add the options that ROS 2's verbs have for its discovery, which callboard does not need.

    Args:
        parser: The verb's.
        daemon: ROS 2's verb can ask its daemon.
        clock: What simulated time changes here; "" for nothing.
    """
    parser.add_argument(
        "--spin-time", type=float, metavar="SEC", help=f"{IGNORED} the broker knows the graph at once"
    )
    if daemon:
        parser.add_flag("--no-daemon", help=f"{IGNORED} the broker is asked, and there is no daemon")
    parser.add_flag(
        *("-s", "--use-sim-time"), help=clock or f"{IGNORED} nothing that is printed depends on the clock"
    )


def add_json_option(parser: Parser, shape: str = "one document") -> None:
    """Add --json."""
    parser.add_flag("--json", help=f"print JSON, {shape}")


def add_kind_options(parser: Parser) -> None:
    """Add ROS 2's options for kinds of interfaces."""
    parser.add_flag("-m", "--only-msgs", help="messages")
    parser.add_flag("-s", "--only-srvs", help="services")
    parser.add_flag("-a", "--only-actions", help="actions")


def chosen_kinds(options: Options) -> list[str]:
    """Return the requested kinds of interfaces: all if none is."""
    wanted = {"msg": options.only_msgs, "srv": options.only_srvs, "action": options.only_actions}
    return [kind for kind in wanted if wanted[kind]] or list(wanted)


def add_qos_options(parser: Parser) -> None:
    """Add ROS 2's options for QoS: a preset, and single policies."""
    parser.add_argument(
        "--qos-profile", choices=QOS_PRESETS, metavar="NAME", help=f"a preset: {', '.join(QOS_PRESETS)}"
    )
    parser.add_argument(
        "--qos-depth", type=count_or_zero, metavar="N", help="messages to keep; 0: as the profile says"
    )
    for policy, about in {
        "history": "which messages to keep",
        "reliability": "whether to keep count",
        "durability": "transient_local: for late joiners, too",
        "liveliness": "how a publisher shows that it is alive",
    }.items():
        parser.add_argument(f"--qos-{policy}", choices=QOS_POLICIES[policy], help=about)
    parser.add_argument(
        "--qos-liveliness-lease-duration-seconds", type=positive, metavar="SEC",
        help="a publisher shows that it is alive at least this often",
    )  # fmt: skip


def add_node_name_option(parser: Parser) -> None:
    """Add ROS 2's option for the name of the verb's own node."""
    parser.add_argument(
        "-n", "--node-name", metavar="NAME", help="the name of the verb's node; default: a hidden one"
    )


def add_watch_options(parser: Parser, *, window: str, subscribe: bool = True) -> None:
    """Add the options that `topic hz`, `bw` and `delay` share.

    Args:
        parser: The verb's.
        window: The default of --window.
        subscribe: The verb can use the broker's counters, too, whose windows are approximate.
    """
    about = (
        " (approximate without --subscribe: a reading of the counters may find several)" if subscribe else ""
    )
    least = ", and the last second at least" if subscribe else ""
    parser.add_argument(
        "-w", "--window", type=count, metavar="N",
        help=f"messages in the window{about}; default: {window}{least}",
    )  # fmt: skip
    if subscribe:
        parser.add_flag(
            "--subscribe",
            help="measure received messages instead of the broker's counters; always done for hz --once, and"
            " if another broker of the mesh has publishers",
        )
    parser.add_flag("--once", help="print the first result and end")
    parser.add_argument(
        "--timeout", type=positive, metavar="SEC", help="exit with 124 if no message arrives for this long"
    )


def add_print_options(parser: Parser, *, live: bool = True) -> None:
    """Add the options for printing messages.

    Args:
        parser: Where to add them.
        live: Whether messages arrive, so that a time limit is of use.
    """
    # Those that only `topic echo` has.
    parser.set_defaults(
        **dict.fromkeys(("field", "filter", "node_name")),
        **dict.fromkeys(("raw", "clear", "include_message_info", "no_lost_messages"), False),
    )
    parser.add_flag("--once", help="print one message and end")
    if live:
        parser.add_argument(
            "--timeout",
            type=positive,
            metavar="SEC",
            help="exit with 124 if no message arrives for this long",
        )
    parser.add_flag("--csv", help="print the values, separated by commas")
    parser.add_flag("--flow-style", help="print each message in one line")
    parser.add_flag("--no-arr", help="describe arrays rather than print them")
    parser.add_flag("--no-str", help="describe strings rather than print them")
    parser.add_flag("-f", "--full-length", help="do not truncate anything")
    parser.add_argument(
        "-l", "--truncate-length", type=count_or_zero, metavar="N", default=SHOWN_LENGTH,
        help=f"truncate strings and arrays to this length; default: {SHOWN_LENGTH}",
    )  # fmt: skip
    add_json_option(parser, "one document per line, never truncated")


def add_field_options(parser: Parser) -> None:
    """Add the options that choose messages by an expression, and a part of each."""
    parser.add_argument(
        "--field", metavar="PATH", help="only this part, such as pose.position.x or points[0]"
    )
    parser.add_argument(
        "--filter",
        metavar="EXPR",
        help="only messages for which this Python expression about m holds (it is evaluated): 'm.data > 3'",
    )


def domain(text: str) -> int:
    """Read a domain id."""
    if not re.fullmatch(r"[0-9]{1,3}", text) or int(text) > MAX_DOMAIN:
        raise argparse.ArgumentTypeError(f"expected an integer from 0 to {MAX_DOMAIN}, got '{text}'")
    return int(text)


def count(text: str) -> int:
    """Read an integer of 1 or more."""
    if not re.fullmatch(r"[0-9]{1,9}", text) or int(text) < 1:
        raise argparse.ArgumentTypeError(f"expected an integer of 1 or more, got '{text}'")
    return int(text)


def count_or_zero(text: str) -> int:
    """Read an integer of 0 or more."""
    if not re.fullmatch(r"[0-9]{1,9}", text):
        raise argparse.ArgumentTypeError(f"expected an integer of 0 or more, got '{text}'")
    return int(text)


def size(text: str) -> int:
    """Read a number of bytes, of 0 or more."""
    if not re.fullmatch(r"[0-9]{1,15}", text):
        raise argparse.ArgumentTypeError(f"expected a number of bytes, got '{text}'")
    return int(text)


def not_negative(text: str) -> float:
    """Read zero or a number above it."""
    return 0.0 if re.fullmatch(r"0*\.?0+", text) else positive(text)


def positive(text: str) -> float:
    """Read a number above zero."""
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not 0 < number < math.inf:
        raise argparse.ArgumentTypeError(f"expected a number above 0, got '{text}'")
    return number


def import_from_working_directory() -> None:
    """Make packages in the current directory importable, and interfaces from their files and from ROS 2's."""
    from pathlib import Path  # noqa: PLC0415 - most commands do without

    from actors.interfaces.file_packages import install_finder  # noqa: PLC0415 - most commands do without
    from actors.tools.prefixes import use_ros_interfaces  # noqa: PLC0415 - most commands do without

    install_finder()
    use_ros_interfaces()
    here = str(Path.cwd())
    if here not in sys.path:
        sys.path.append(here)
