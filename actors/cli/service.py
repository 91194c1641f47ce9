"""`callboard service`: list, call."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from actors.cli.parsing import add_broker_options, add_json_option, add_verbs, positive

if TYPE_CHECKING:
    import argparse


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the verbs."""
    add = add_verbs(parser)
    _list_arguments(add("list", "list services"))
    _call_arguments(add("call", "call a service"))


def _list_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("-t", "--show-types", action="store_true", help="with their types")
    parser.add_argument("-c", "--count-services", action="store_true", help="only how many there are")
    parser.add_argument("--include-hidden-services", action="store_true", help="also names with a leading _")
    add_json_option(parser)
    add_broker_options(parser)


def _call_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("service", metavar="NAME", help="such as /add_two_ints")
    parser.add_argument("type", metavar="TYPE", help="such as example_interfaces/srv/AddTwoInts")
    parser.add_argument(
        "values", metavar="VALUES", nargs="?", default="{}", help="a YAML map: '{a: 5, b: 3}'"
    )
    parser.add_argument("-r", "--rate", type=positive, metavar="HZ", help="call again and again")
    parser.add_argument(
        "--timeout", type=positive, metavar="SEC",
        help="end with 124 when no server comes, or no reply, within this time; default: for a reply 60",
    )  # fmt: skip
    add_json_option(parser, "the response alone")
    add_broker_options(parser)


def run(options: argparse.Namespace) -> int:
    """Run the verb that was chosen; its code is imported only now."""
    module: Any = import_module(f"actors.cli.service_{options.verb}")
    code: int = module.run(options)
    return code
