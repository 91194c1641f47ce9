"""Descriptions of programs, for `ExecuteLocal`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterable

    from actors.launch.description.substitutions import Text


class Executable:
    """A program: its command, and the options of `ExecuteProcess` that are about it.

    Args:
        cmd: The program and its arguments.
        arguments: Further arguments.
        given: prefix, name, cwd, env, additional_env.

    Attributes:
        options: The arguments of `ExecuteProcess`.
    """

    def __init__(self, *, cmd: Iterable[Text], arguments: Iterable[Text] | None = None, **given: Any) -> None:
        self.options: dict[str, Any] = {"cmd": [*cmd, *(arguments or ())], **given}
