"""Levels of log messages."""

from __future__ import annotations

from actors.logging.severity import LoggingSeverity as LoggingSeverity
