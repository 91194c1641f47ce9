"""`callboard doctor`: print checks with their findings and remedies."""

from __future__ import annotations

import sys
import textwrap
from collections import Counter
from typing import TYPE_CHECKING, Final

from actors.cli.errors import FAILURE, OK
from actors.cli.interrupts import raise_at_once
from actors.cli.output import print_json
from actors.cli.parsing import Options, Parser, add_broker_options, add_json_option
from actors.cli.terminal import terminal_width

if TYPE_CHECKING:
    from actors.cli.tables import Style
    from actors.tools.check import Check, Status

EXAMPLES: Final = {
    "callboard doctor": "all checks; exits with 1 if one fails",
    "callboard doctor --json": "the same for programs",
    "callboard doctor -rf": "only what failed",
    "callboard doctor --config broker.toml": "also the files that a broker's configuration names",
}
_STYLES: Final[dict[Status, Style]] = {"ok": "good", "warn": "warn", "fail": "bad", "skip": "dim"}
_SECRETS: Final = ("auth", "tls_key", "mesh_auth", "mesh_config", "http_token", "bridge_token")
_CERTIFICATES: Final = ("tls_cert", "tls_client_ca")
"""Options of a broker that name such files."""
_PACKAGES: Final = {"event loop", "codec", "import names"}
"""The checks of installed packages."""
_STATUS_WIDTH: Final = 4
_NARROWEST: Final = 20


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    shown = parser.add_mutually_exclusive_group()
    shown.add_argument(
        "-r", "--report", action="store_true", help="print all checks, as without it; for ROS 2's sake"
    )
    shown.add_argument("-rf", "--report-failed", action="store_true", help="print only checks that failed")
    parser.add_flag("-ep", "--exclude-packages", help="leave out the checks of installed packages")
    parser.add_flag("-iw", "--include-warnings", help="treat warnings as failures")
    add_json_option(parser, "a list of {name, status, finding, remedy}; status: ok, warn, fail or skip")
    parser.add_argument(
        "--config",
        metavar="FILE",
        help="the configuration of a broker: check it and the files that it names, too",
    )
    add_broker_options(parser)


def run(options: Options) -> int:
    """Run all checks and print the results."""
    from actors.tools.health import all_good, examine

    raise_at_once()
    checks = examine(options.url or None, options.domain, options.context or None)
    if options.config is not None:
        checks = _configuration(options.config) + checks
    if options.exclude_packages:
        checks = [check for check in checks if check.name not in _PACKAGES]
    if options.include_warnings:
        checks = [check._replace(status="fail") if check.status == "warn" else check for check in checks]
    shown = [check for check in checks if check.status == "fail" or not options.report_failed]
    if options.json:
        print_json([check._asdict() for check in shown])
    else:
        _print(shown, checks)
    return OK if all_good(checks) else FAILURE


def _configuration(path: str) -> list[Check]:
    """Return the checks of a broker's configuration and of the files that it names."""
    from pathlib import Path

    from actors.tools.check import Check
    from actors.tools.security_checks import check_files
    from broker.daemon.configuration import load_configuration
    from proto.errors import CallboardError

    try:
        values = load_configuration({}, Path(path)).values()
    except CallboardError as error:
        return [Check("configuration", "fail", str(error), "correct it: the broker would not start")]
    secrets, certificates = (
        {name: str(values[name]) for name in names if values.get(name) is not None}
        for names in (_SECRETS, _CERTIFICATES)
    )
    return [Check("configuration", "ok", path), *check_files(secrets, certificates)]


def _print(shown: list[Check], checks: list[Check]) -> None:
    """Print checks, and the verdict about all."""
    from actors.cli.tables import colored, painted

    color = colored(sys.stdout)
    width = max((len(check.name) for check in shown), default=0)
    indent = " " * (_STATUS_WIDTH + width + 4)
    columns = terminal_width()
    max_width = None if columns is None else max(columns - len(indent), _NARROWEST)
    for check in shown:
        status = painted(check.status, _STYLES[check.status], color=color)
        padding = " " * (_STATUS_WIDTH - len(check.status))
        first, *more = _lines(check.finding, max_width)
        print(f"{status}{padding}  {check.name:<{width}}  {painted(first, '', color=color)}")
        for line in more:
            print(f"{indent}{painted(line, '', color=color)}")
        for line in _lines(check.remedy, max_width) if check.remedy else ():
            print(painted(f"{indent}{line}", "dim", color=color))
    print(f"\n{_verdict(checks)}" if shown else _verdict(checks))


def _lines(text: str, max_width: int | None) -> list[str]:
    """Return a string in lines of a width, if its words fit."""
    if max_width is None or len(text) <= max_width:
        return [text]
    return textwrap.wrap(text, max_width, break_long_words=False, break_on_hyphens=False)


def _verdict(checks: list[Check]) -> str:
    counts = Counter(check.status for check in checks)
    problems = _several(counts["fail"], "problem")
    warnings = _several(counts["warn"], "warning")
    if counts["fail"]:
        return f"{problems}, {warnings}." if counts["warn"] else f"{problems}."
    return f"Nothing is wrong; {warnings}." if counts["warn"] else "All is well."


def _several(number: int, what: str) -> str:
    return f"{number} {what}{'' if number == 1 else 's'}"
