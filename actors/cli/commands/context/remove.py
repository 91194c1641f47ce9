"""`callboard context remove`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from actors.cli.parsing import Options, Parser

EXAMPLES: Final = {"callboard context remove robot": "forget that broker"}


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    parser.add_argument("context", metavar="CONTEXT", help="its name")


def run(options: Options) -> int:
    """Forget a broker."""
    from actors.cli.broker_target import unknown_context
    from actors.cli.output import print_err
    from actors.config.context_errors import UnknownContextError
    from actors.config.contexts import Contexts

    with Contexts.changing() as contexts:
        before = contexts.current
        try:
            contexts.remove(options.context)
        except UnknownContextError as error:
            raise unknown_context(error) from error
    if contexts.current != before:
        print_err(f"It was in use: from now on the context is '{contexts.current}'")
    return 0
