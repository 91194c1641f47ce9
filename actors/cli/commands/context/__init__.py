"""`callboard context`: named brokers."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from actors.config.contexts import Contexts


def use_context(contexts: Contexts, name: str) -> None:
    """Make a context the current one.

    Raises:
        CommandError: There is no such context.
    """
    from actors.cli.broker_target import unknown_context
    from actors.config.context_errors import UnknownContextError

    try:
        contexts.use(name)
    except UnknownContextError as error:
        raise unknown_context(error) from error


def print_current(contexts: Contexts) -> None:
    """Print which broker commands and nodes use now, also if a variable overrides the choice."""
    from actors.cli.output import print_err, print_out
    from actors.config import environment

    name = contexts.current
    if (url := environment.broker_url()) is not None:
        variable, where = "CALLBOARD_URL", url
    elif (other := environment.context_name() or name) != name:
        variable, where = "CALLBOARD_CONTEXT", f"context '{other}'"
    else:
        print_out(f"Commands and nodes go to {contexts.get(name).url} from now on")
        return
    print_out(f"The current context is '{name}'")
    print_err(f"{variable} overrides it: commands and nodes go to {where} until you unset {variable}")
