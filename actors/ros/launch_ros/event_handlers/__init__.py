"""Event handlers of lifecycle nodes."""

from __future__ import annotations

from actors.launch import OnStateTransition as OnStateTransition
