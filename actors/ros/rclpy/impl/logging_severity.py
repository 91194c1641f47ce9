"""Levels of log messages."""

from __future__ import annotations

from actors.logging.logger import LoggingSeverity as LoggingSeverity
