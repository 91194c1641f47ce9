"""Descriptions: what they consist of."""

from __future__ import annotations

import pytest

from actors.launch.description.actions import LogInfo
from actors.launch.description.description import LaunchDescription
from actors.launch.errors import LaunchError

ONE, TWO = LogInfo(msg="1"), LogInfo(msg="2")


def test_actions_are_kept_for_reuse() -> None:
    """Also those that come one after the other, and those that are added later."""
    description = LaunchDescription(iter([ONE]))
    description.add_action(TWO)
    assert description.actions == (ONE, TWO)
    assert LaunchDescription() == LaunchDescription([])


@pytest.mark.parametrize("wrong", ["talker", None, LaunchDescription()])
def test_what_is_no_action_is_an_error(wrong: object) -> None:
    """At once, whichever way it comes in."""
    with pytest.raises(LaunchError, match="A launch description has actions in it, such as Node"):
        LaunchDescription([wrong])  # type: ignore[list-item]
    with pytest.raises(LaunchError, match="A launch description has actions in it, such as Node"):
        LaunchDescription().add_action(wrong)  # type: ignore[arg-type]


def test_an_action_alone_is_an_error() -> None:
    """It needs a list around it."""
    with pytest.raises(LaunchError, match="LaunchDescription: actions must be a list of them, not LogInfo"):
        LaunchDescription(ONE)  # type: ignore[arg-type]
