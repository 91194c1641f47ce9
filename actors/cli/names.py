"""Names on a command line: made absolute, and what to say of those that the graph does not have."""

from __future__ import annotations

from typing import TYPE_CHECKING

from actors.cli.errors import USAGE, CommandError
from actors.tools.suggestions import did_you_mean
from proto.names import validate_full_service_name, validate_full_topic_name

if TYPE_CHECKING:
    from collections.abc import Iterable


def topic_name(text: str) -> str:
    """Return a topic's full name; the first slash may be left out.

    Raises:
        InvalidTopicNameError: No topic can have this name.
    """
    full = _absolute(text)
    validate_full_topic_name(full)
    return full


def service_name(text: str) -> str:
    """Return a service's full name; the first slash may be left out.

    Raises:
        InvalidServiceNameError: No service can have this name.
    """
    full = _absolute(text)
    validate_full_service_name(full)
    return full


def node_name(text: str) -> str:
    """Return a node's full name; the first slash may be left out."""
    if not text.strip("/"):
        raise CommandError("Which node? Write its full name, such as /talker", USAGE)
    return _absolute(text)


def unknown(text: str, name: str, known: Iterable[str]) -> CommandError:
    """Return the error for a name that is not in the graph, with what may have been meant.

    Args:
        text: ROS 2's text.
        name: The name.
        known: The names that there are.
    """
    return CommandError(f"{text}{did_you_mean(name, known)}")


def _absolute(text: str) -> str:
    return text if text.startswith("/") or not text else f"/{text}"
