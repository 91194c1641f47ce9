"""`callboard bench`: how fast callboard is on this machine."""

from __future__ import annotations

import argparse
from typing import Final

from actors.cli.errors import FAILURE, OK
from actors.cli.output import print_err, print_json, print_out
from actors.cli.parsing import Options, Parser, add_json_option, count, positive

WORKLOADS: Final = tuple(f"W{number}" for number in range(1, 13))


EXAMPLES: Final = {
    "callboard bench": "everything, in about a minute",
    "callboard bench W1 W3 --seconds 2": "one-to-one throughput and latency, measured longer",
}


def add_arguments(parser: Parser) -> None:
    """Describe the verb."""
    parser.add_argument(
        "workloads",
        nargs="*",
        type=_workload,
        metavar="WORKLOAD",
        help="W1 to W12; default: what of them takes a minute together",
    )
    parser.add_argument(
        "--seconds", type=positive, metavar="SEC", default=0.5, help="length of each load; default: 0.5"
    )
    parser.add_argument(
        "--repetitions",
        type=count,
        metavar="N",
        default=3,
        help="trials of each case but those of W5 and W8; default: 3",
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
    from actors.bench.alone import measure
    from actors.bench.tables import report
    from actors.bench.workloads import chosen
    from actors.cli.loop import run_async

    workloads = chosen(options.workloads)
    results = run_async(
        lambda: measure(
            workloads,
            seconds=options.seconds,
            repetitions=options.repetitions,
            loop=options.loop,
            transport=options.transport,
            rules=options.rules,
            command=" ".join(["callboard bench", *options.workloads]),
        )
    )
    if options.json:
        print_json(results.document())
    else:
        print_out("\n".join(report(results, workloads, results.entrants[0].name)))
    for failure in results.failures:
        print_err(f"{failure.workload} {failure.case} failed: {failure.reason}")
    return FAILURE if results.failures else OK


def _workload(text: str) -> str:
    """Read a workload's id."""
    if text.upper() not in WORKLOADS:
        raise argparse.ArgumentTypeError(f"expected one of {', '.join(WORKLOADS)}, got '{text}'")
    return text.upper()
