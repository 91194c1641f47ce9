"""`callboard bench`: how fast callboard is on this machine."""

from __future__ import annotations

import argparse
from typing import Final

from actors.cli.errors import FAILURE, OK
from actors.cli.output import print_err, print_json, print_out
from actors.cli.parsing import Options, Parser, add_json_option, count, positive

WORKLOADS: Final = ("W1", "W3", "W4")
IN_A_CHECKOUT: Final = tuple(f"W{number}" for number in range(1, 13))


EXAMPLES: Final = {
    "callboard bench": "everything, in about half a minute",
    "callboard bench W1 W3 --seconds 2": "one-to-one throughput and latency, measured longer",
}


def add_arguments(parser: Parser) -> None:
    """Describe the verb."""
    parser.add_argument(
        "workloads",
        nargs="*",
        type=_workload,
        metavar="WORKLOAD",
        help="W1, W3 or W4; default: all, without the largest messages of W1",
    )
    parser.add_argument(
        "--seconds", type=positive, metavar="SEC", default=0.5, help="length of each load; default: 0.5"
    )
    parser.add_argument(
        "--repetitions", type=count, metavar="N", default=3, help="trials of each case; default: 3"
    )
    parser.add_argument("--loop", choices=("uvloop", "asyncio"), default="uvloop", help="default: uvloop")
    parser.add_argument(
        "--transport",
        choices=("auto", "tcp", "tls"),
        default="auto",
        help="default: auto, as nodes on the broker's machine choose",
    )
    parser.add_argument(
        "--rules",
        type=count,
        metavar="N",
        default=0,
        help="give the broker N access rules; default: none",
    )
    add_json_option(parser)


def run(options: Options) -> int:
    """Measure, and print what came out."""
    from actors.cli.bench.results import measure, report
    from actors.cli.bench.setup import Setup
    from actors.cli.loop import run_async

    setup = Setup(loop=options.loop, transport=options.transport, rules=options.rules)
    document = run_async(
        lambda: measure(options.workloads, setup, seconds=options.seconds, repetitions=options.repetitions)
    )
    if options.json:
        print_json(document)
    else:
        print_out("\n".join(report(document)))
    for failure in document["failures"]:
        print_err(f"{failure['workload']} {failure['case']} failed: {failure['reason']}")
    return FAILURE if document["failures"] else OK


def _workload(text: str) -> str:
    """Read a workload's id."""
    name = text.upper()
    if name in WORKLOADS:
        return name
    if name in IN_A_CHECKOUT:
        raise argparse.ArgumentTypeError(
            f"{name} is not installed; run it in a checkout of callboard: "
            f"python benchmarks/suite.py {name} --peers ''"
        )
    raise argparse.ArgumentTypeError(f"expected one of {', '.join(WORKLOADS)}, got '{text}'")
