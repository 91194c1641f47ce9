"""Lines that say how many messages a verb has handled."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping


def counted(number: int, noun: str) -> str:
    """Return a number with its noun, such as "1 topic" or "2,000 messages"."""
    return f"{number:,} {noun}{'' if number == 1 else 's'}"


def messages_of_topics(topics: Mapping[str, int]) -> str:
    """Return how many messages there are of how many topics, such as "100 messages of 1 topic".

    Args:
        topics: The number of messages by topic; topics without messages do not count.
    """
    count = sum(1 for each in topics.values() if each)
    return f"{counted(sum(topics.values()), 'message')} of {counted(count, 'topic')}"


def summary_of(bags: object, topics: Mapping[str, int], verdict: str, missing: Mapping[str, int]) -> str:
    """Return how many messages were recorded or played, and how many are missing, in one line.

    Args:
        bags: The path of the bag, or the names of several.
        topics: The number of recorded or played messages by topic.
        verdict: What did not happen to the missing messages, such as "not played".
        missing: The number of missing messages by reason.
    """
    reasons = ", ".join(f"{number:,} {reason}" for reason, number in missing.items() if number)
    return f"{bags}: {messages_of_topics(topics)}{f'; {verdict}: {reasons}' if reasons else ''}"
