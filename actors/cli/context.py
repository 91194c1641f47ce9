"""`callboard context`: named brokers."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING

from actors.cli.errors import CommandError
from actors.cli.output import note, say, say_json
from actors.cli.place import unknown_context
from actors.cli.tables import Styled, say_table
from actors.config import environment
from actors.config.contexts import Context, Contexts, UnknownContextError, find_place

if TYPE_CHECKING:
    import argparse


def list_contexts(options: argparse.Namespace) -> int:
    """Print all contexts."""
    contexts = Contexts.load()
    found = {name: contexts.get(name) for name in contexts.names()}
    if options.json:
        say_json(
            [
                {"name": name, **asdict(each), "current": name == contexts.current}
                for name, each in found.items()
            ]
        )
        return 0
    rows = [
        (
            Styled("*" if name == contexts.current else "", "good"),
            name,
            each.url,
            "" if each.domain is None else each.domain,
            each.description,
        )
        for name, each in found.items()
    ]
    say_table(
        rows, header=("", "NAME", "URL", "DOMAIN", "DESCRIPTION"), style=("", "name", "", "count", "dim")
    )
    return 0


def show(options: argparse.Namespace) -> int:
    """Print where commands and nodes go, and what says so."""
    try:
        place = find_place(context=options.context)
    except UnknownContextError as error:
        raise unknown_context(error) from error
    if options.json:
        say_json({**place._asdict(), "urls": [str(url) for url in place.urls]})
    else:
        say_table(
            [("url", place.url, place.url_from), ("domain", place.domain, place.domain_from)],
            style=("", "name", "dim"),
        )
    return 0


def use(options: argparse.Namespace) -> int:
    """Go to a broker from now on."""
    with Contexts.changing() as contexts:
        _use(contexts, options.context)
    _say_where(contexts)
    return 0


def add(options: argparse.Namespace) -> int:
    """Give a broker a name."""
    context = Context(url=options.url, domain=options.domain, description=options.description)
    with Contexts.changing() as contexts:
        if options.name in contexts.named and not options.replace:
            raise CommandError(f"There is a context '{options.name}' already; --replace gives it another URL")
        contexts.add(options.name, context, replace=options.replace)
        if options.use:
            _use(contexts, options.name)
    if options.use:
        _say_where(contexts)
    else:
        say(f"Added '{options.name}'. To go there: callboard context use {options.name}")
    return 0


def remove(options: argparse.Namespace) -> int:
    """Forget a broker."""
    with Contexts.changing() as contexts:
        before = contexts.current
        try:
            contexts.remove(options.context)
        except UnknownContextError as error:
            raise unknown_context(error) from error
    if contexts.current != before:
        note(f"It was in use: from now on the context is '{contexts.current}'")
    return 0


def _use(contexts: Contexts, name: str) -> None:
    try:
        contexts.use(name)
    except UnknownContextError as error:
        raise unknown_context(error) from error


def _say_where(contexts: Contexts) -> None:
    name = contexts.current
    if (url := environment.broker_url()) is not None:
        variable, where = "CALLBOARD_URL", url
    elif (other := environment.context_name() or name) != name:
        variable, where = "CALLBOARD_CONTEXT", f"context '{other}'"
    else:
        say(f"Commands and nodes go to {contexts.get(name).url} from now on")
        return
    say(f"The current context is '{name}'")
    note(f"{variable} overrides it: commands and nodes go to {where} until you unset {variable}")
