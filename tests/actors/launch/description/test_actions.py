"""Actions are data that can be looked at again."""

from __future__ import annotations

from actors.launch.description.actions import GroupAction, IncludeLaunchDescription, LogInfo
from actors.launch.description.process_actions import ExecuteProcess, Node


def test_iterators_are_kept_as_tuples() -> None:
    """They would be empty the second time that somebody looks."""
    names = {"a": "b"}
    assert Node(remappings=iter([("a", "b")])).remappings == (("a", "b"),)
    assert IncludeLaunchDescription("f", launch_arguments=zip("a", "b", strict=True)).launch_arguments == (
        ("a", "b"),
    )
    assert GroupAction(LogInfo(msg=each) for each in "ab").actions == (  # type: ignore[arg-type]
        LogInfo(msg="a"),
        LogInfo(msg="b"),
    )
    assert IncludeLaunchDescription("f", launch_arguments=names.items()).launch_arguments == names.items()
    assert ExecuteProcess(cmd=["a"]).cmd == ["a"]
