"""`callboard context use`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.cli.commands.context import print_current, use_context

if TYPE_CHECKING:
    from actors.cli.parsing import Options, Parser

EXAMPLES: Final = {
    "callboard context use robot": "go to that broker from now on",
    "callboard context use default": "go to callboard://127.0.0.1:7411 again",
}


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    parser.add_argument("context", metavar="CONTEXT", help="its name")


def run(options: Options) -> int:
    """Go to a broker from now on."""
    from actors.config.contexts import Contexts

    with Contexts.changing() as contexts:
        use_context(contexts, options.context)
    print_current(contexts)
    return 0
