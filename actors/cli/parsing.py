"""Arguments: one-line errors with a remedy, and the options that many verbs share."""

from __future__ import annotations

import argparse
import math
import re
import sys
from typing import TYPE_CHECKING, Any, Final, NoReturn

from actors.cli.errors import USAGE
from actors.cli.terminal import columns
from actors.config.environment import MAX_DOMAIN
from actors.tools.suggestions import did_you_mean

if TYPE_CHECKING:
    from collections.abc import Mapping

    from actors.cli.table import Verb

SHOWN_LENGTH: Final = 128
"""What is shown of a string or sequence, as in ROS 2."""
QOS_PRESETS: Final = (
    *("default", "system_default", "sensor_data", "services_default", "parameters", "parameter_events"),
    *("action_status_default", "best_available", "rosout_default"),
)
"""Those of actors.qos.profile.QoSPresetProfiles that somebody can ask for."""
_CHOICE: Final = re.compile(r"argument (\S+): invalid choice: '(.*)' \(choose from (.*)\)", re.DOTALL)


class Parser(argparse.ArgumentParser):
    """An argparse parser that says what is wrong in one line. Options are never abbreviated."""

    def __init__(self, **options: Any) -> None:
        options.setdefault("allow_abbrev", False)
        super().__init__(**options)

    def parse_args(self, args: Any = None, namespace: Any = None) -> Any:  # pyright: ignore[reportIncompatibleMethodOverride]
        """Read a command line; options may stand between arguments."""
        if any(action.nargs in {argparse.REMAINDER, argparse.PARSER} for action in self._actions):
            return super().parse_args(args, namespace)
        found, rest = self.parse_known_intermixed_args(args, namespace)
        if rest:
            # Behind an option that it does not know argparse takes the rest for unknown, too.
            unknown = [each for each in rest if each.startswith("-")] or rest
            self.error(f"unrecognized arguments: {' '.join(unknown)}")
        return found

    def error(self, message: str) -> NoReturn:
        """Print the text and what helps, and exit with 2."""
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
    """As wide as the terminal. Python's own imports shutil to know that, also where nobody asks for help."""

    def __init__(self, prog: str, **options: Any) -> None:
        options.setdefault("width", columns() - 2)
        super().__init__(prog, **options)


def parser_of(command: str, verb: Verb, module: Any) -> Parser:
    """Return the parser of a verb, such as "topic list", whose module has been imported."""
    summary = f"{verb.summary[0].upper()}{verb.summary[1:]}."
    parser = Parser(
        prog=f"callboard {command}",
        description=summary,
        epilog=_shown_examples(module.EXAMPLES),
        formatter_class=_Help,
    )
    module.add_arguments(parser)
    return parser


def _shown_examples(examples: Mapping[str, str]) -> str:
    lines = [f"  {line}\n      {what}" for line, what in examples.items()]
    return "\n".join(["examples:", *lines])


def add_broker_options(parser: argparse.ArgumentParser) -> None:
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
        help=f"the graph, 0 to {MAX_DOMAIN}; default: CALLBOARD_DOMAIN, then the context's, then 0",
    )
    parser.add_argument(
        "--context",
        metavar="CONTEXT",
        help="a broker named with `callboard context add`; default: CALLBOARD_CONTEXT, then the one in use",
    )


def add_json_option(parser: argparse.ArgumentParser, shape: str = "one document") -> None:
    """Add --json."""
    parser.add_argument("--json", action="store_true", help=f"print JSON, {shape}")


def add_kind_options(parser: argparse.ArgumentParser) -> None:
    """Add ROS 2's options for kinds of interfaces."""
    parser.add_argument("-m", "--only-msgs", action="store_true", help="messages")
    parser.add_argument("-s", "--only-srvs", action="store_true", help="services")
    parser.add_argument("-a", "--only-actions", action="store_true", help="actions")


def add_qos_options(parser: argparse.ArgumentParser) -> None:
    """Add ROS 2's options for QoS: a preset, and single policies."""
    parser.add_argument(
        "--qos-profile", choices=QOS_PRESETS, metavar="NAME", help=f"a preset: {', '.join(QOS_PRESETS)}"
    )
    parser.add_argument("--qos-depth", type=count, metavar="N", help="messages to keep")
    parser.add_argument("--qos-history", choices=("keep_last", "keep_all"), help="what to keep")
    parser.add_argument(
        "--qos-reliability", choices=("reliable", "best_effort"), help="whether to keep count"
    )
    parser.add_argument(
        "--qos-durability",
        choices=("volatile", "transient_local"),
        help="transient_local: for late joiners, too",
    )
    parser.add_argument(
        "--qos-liveliness", choices=("automatic", "manual_by_topic"), help="what shows that a publisher lives"
    )
    parser.add_argument(
        "--qos-liveliness-lease-duration-seconds", type=positive, metavar="SEC",
        help="a publisher shows itself at least this often",
    )  # fmt: skip


def add_watch_options(parser: argparse.ArgumentParser, *, window: str, subscribe: bool = True) -> None:
    """Add what `topic hz`, `bw` and `delay` have in common.

    Args:
        parser: The verb's.
        window: The messages to look back on if --window says nothing.
        subscribe: The verb can count by the broker, too; then a window is about right, and a second at least.
    """
    about = (
        " (about so many without --subscribe: a look at the counters may find several)" if subscribe else ""
    )
    least = ", and the last second at least" if subscribe else ""
    parser.add_argument(
        "-w", "--window", type=count, metavar="N",
        help=f"messages to look back on{about}; default: {window}{least}",
    )  # fmt: skip
    if subscribe:
        parser.add_argument(
            "--subscribe", action="store_true", help="measure what comes here, not what the broker counts"
        )
    parser.add_argument("--once", action="store_true", help="print the first result and end")
    parser.add_argument(
        "--timeout", type=positive, metavar="SEC", help="end with 124 when no message comes for this long"
    )


def add_print_options(parser: argparse.ArgumentParser) -> None:
    """Add how messages are printed, and how many."""
    parser.add_argument("--once", action="store_true", help="print one message and end")
    parser.add_argument(
        "--timeout", type=positive, metavar="SEC", help="end with 124 when no message comes for this long"
    )
    parser.add_argument("--csv", action="store_true", help="the values, separated by commas")
    parser.add_argument("--flow-style", action="store_true", help="each message in one line")
    parser.add_argument("--no-arr", action="store_true", help="describe arrays rather than print them")
    parser.add_argument("--no-str", action="store_true", help="describe strings rather than print them")
    parser.add_argument("-f", "--full-length", action="store_true", help="cut nothing short")
    parser.add_argument(
        "-l", "--truncate-length", type=count_or_zero, metavar="N", default=SHOWN_LENGTH,
        help=f"cut strings and arrays to this length; default: {SHOWN_LENGTH}",
    )  # fmt: skip
    add_json_option(parser, "one document a line, never cut short")


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


def positive(text: str) -> float:
    """Read a number above zero."""
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not 0 < number < math.inf:
        raise argparse.ArgumentTypeError(f"expected a number above 0, got '{text}'")
    return number
