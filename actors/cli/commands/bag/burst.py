"""`callboard bag burst`: publish messages of a bag at once."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.cli.commands.bag import arguments, play
from actors.cli.parsing import add_broker_options, add_json_option, count_or_zero

if TYPE_CHECKING:
    from actors.cli.parsing import Options, Parser

EXAMPLES: Final = {
    "callboard bag burst trip": "everything, as fast as the broker takes it",
    "callboard bag burst trip --topics /tf_static /map -n 2": "the first two messages, then pause",
}


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    arguments.add_bag(parser)
    arguments.add_storage(parser)
    parser.add_argument(
        "-n", "--num-messages", type=count_or_zero, metavar="N", default=0,
        help="publish this many, then stay paused; 0 (default): publish all, then end",
    )  # fmt: skip
    play.add_reading(parser)
    for what, noun in {"topics": "TOPIC", "services": "SERVICE"}.items():
        parser.add_argument(f"--{what}", nargs="+", metavar=noun, default=[], help=f"{what} to publish")
    play.add_publishing(parser)
    arguments.add_node(parser, "bag_player")
    add_json_option(parser, "one document at the end")
    add_broker_options(parser)


def run(options: Options) -> int:
    """Publish the messages; go on as `bag play --start-paused` does if there are more."""
    defaults = play.defaults()
    for name, value in defaults.items():
        if not hasattr(options, name):
            setattr(options, name, value)
    options.start_paused = True
    return play.run(options)
