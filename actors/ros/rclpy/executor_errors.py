"""Exceptions that end a wait for work."""

from __future__ import annotations


class TimeoutException(Exception):
    """There was no work within the timeout."""


class ShutdownException(Exception):
    """The executor has been shut down."""


class ExternalShutdownException(Exception):
    """The context has been shut down, as by a signal."""

    def __init__(self, message: str | None = None) -> None:
        super().__init__(message or "The context has been shut down")


class ConditionReachedException(Exception):
    """The condition to wait for holds."""
