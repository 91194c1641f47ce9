"""Options of nodes, as one object and as keywords."""

from __future__ import annotations

import dataclasses
import re
import textwrap
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

import actors
import callboard
from actors.interfaces.std_msgs.msg import Int64
from actors.node.options import NodeKeywords

if TYPE_CHECKING:
    from tests.actors.meeting import Meeting

DOCUMENT = Path(__file__).parents[3] / "docs/reference/node-options.md"


def test_each_field_is_a_keyword_of_the_same_type() -> None:
    """And each keyword is a field."""
    fields = {field.name: field.type for field in dataclasses.fields(actors.NodeOptions)}
    keywords = {name: hint.__forward_arg__ for name, hint in NodeKeywords.__annotations__.items()}
    assert keywords == fields


def test_the_reference_has_each_field_with_its_default() -> None:
    """In the order of the class."""
    rows = re.findall(r"^\| `(\w+)` \| `(.+?)` \|", DOCUMENT.read_text(encoding="utf-8"), re.MULTILINE)
    assert rows == [(field.name, repr(field.default)) for field in dataclasses.fields(actors.NodeOptions)]


def test_the_program_in_the_reference_runs() -> None:
    """Nodes can be made without a broker."""
    program = re.search(r"^    options = (?:.+\n)+", DOCUMENT.read_text(encoding="utf-8"), re.MULTILINE)
    assert program is not None
    names: dict[str, Any] = {"callboard": callboard}
    exec(textwrap.dedent(program[0]), names)
    assert names["lidar"].get_name() == "lidar"


async def test_a_keyword_wins_over_the_options(meeting: Meeting) -> None:
    """Fields that no keyword names are as in the options, also those of lifecycle nodes."""
    options = actors.NodeOptions(url=meeting.url, shared_name=True, strict_qos=True)
    async with (
        actors.Node("twin", options=options) as node,
        actors.LifecycleNode("twin", options=options) as twin,
        actors.Node("other", options=options, strict_qos=False) as other,
    ):
        for each in (node, twin, other):
            each.create_publisher(Int64, "numbers")
        await meeting.settled(node, twin, other)
        infos = await node.get_publishers_info_by_topic("numbers")
        assert sorted((each.node_name, each.strict_qos) for each in infos) == [
            ("other", False),
            ("twin", True),
            ("twin", True),
        ]


def test_bad_options_are_refused_where_they_are_made() -> None:
    """Also as keywords; an unknown keyword is a TypeError, as everywhere."""
    with pytest.raises(ValueError, match="stop_timeout_sec"):
        actors.NodeOptions(stop_timeout_sec=-1)
    for wrong in ("", "localhost", "10.0.0.0/8", "fe80::1%eth0", "1" * 46):
        with pytest.raises(ValueError, match="client_address must be an IP address, such as"):
            actors.NodeOptions(client_address=wrong)
    with pytest.raises(ValueError, match="stop_timeout_sec"):
        actors.Node("n", stop_timeout_sec=-1)
    with pytest.raises(TypeError, match="strict_qo"):
        actors.Node("n", strict_qo=True)  # type: ignore[call-arg]


def test_options_hide_the_token() -> None:
    """Programs may log them."""
    assert "secret" not in repr(actors.NodeOptions(token="secret"))
