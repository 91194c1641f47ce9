"""Bags in the libraries with which Foxglove's page reads them; `node` runs these, without a browser."""

from __future__ import annotations

import json
import random
import subprocess
from typing import TYPE_CHECKING, Any, Final, cast

from actors.bags import BagTopic, Writer
from actors.interfaces import cdr
from actors.interfaces.catalog import interfaces_of, standard_packages
from actors.interfaces.message import type_name
from actors.interfaces.registry import find_interface
from tests.actors.bags.bags import START_NS
from tests.actors.bags.test_foreign import has_wstring, message_types
from tests.integration.conftest import ROOT
from tests.interfaces.random_messages import message_classes, random_message, values_of

if TYPE_CHECKING:
    from pathlib import Path

    from actors.interfaces.message import Message

UNREADABLE: Final = {"rcl_interfaces/msg/ParameterType", "statistics_msgs/msg/StatisticDataType"}
"""Types that have constants only: findings/foxglove-constants-only.sh."""
READER: Final = ROOT / "tests" / "browser" / "bag_reader.mjs"


def recorded_parts() -> list[type[Message]]:
    """Return what is recorded of services and actions: events and feedback."""
    names = [name for package in standard_packages() for name in interfaces_of(package)]
    parts = (part for name in names for part in message_classes(find_interface(name)))
    return [each for each in parts if type_name(each).endswith(("_Event", "_FeedbackMessage"))]


def same(ours: Any, theirs: Any) -> bool:
    """Compare plain values with those of a line: numbers that JSON has not are texts there."""
    if isinstance(ours, dict):
        return ours.keys() == theirs.keys() and all(same(value, theirs[name]) for name, value in ours.items())
    if isinstance(ours, list | bytes):
        return len(ours) == len(theirs) and all(map(same, ours, theirs))
    if isinstance(ours, bool | str):
        return ours is theirs or (isinstance(ours, str) and ours == theirs)
    return repr(ours) == repr(type(ours)(theirs))  # which negative zero has, too


def test_foxglove_reads_all_standard_types(tmp_path: Path) -> None:
    """Every field of a random message of each type, of services' events and of actions' feedback."""
    chance = random.Random(37)
    types = [cls for cls in (*message_types(), *recorded_parts()) if not has_wstring(cls)]
    types = [cls for cls in types if type_name(cls) not in UNREADABLE]
    messages = [random_message(cls, chance) for cls in types]
    with Writer(tmp_path / "bag") as bag:
        for index, message in enumerate(messages):
            number = bag.add_topic(BagTopic.of_class(f"/topic{index}", type(message)))
            bag.write(number, cdr.encode(message), START_NS + index, START_NS - index, index)
    command = ("node", "--input-type=module", "-", str(tmp_path / "bag" / "bag_0.mcap"))
    with READER.open("rb") as script:
        output = subprocess.run(
            command, stdin=script, cwd=ROOT / "build" / "npm", check=True, capture_output=True, timeout=60
        ).stdout
    lines = [cast("dict[str, Any]", json.loads(line)) for line in output.splitlines()]
    for index, (message, line) in enumerate(zip(messages, lines, strict=True)):
        assert (line["topic"], line["sequence"]) == (f"/topic{index}", index)
        assert (line["logTime"], line["publishTime"]) == (str(START_NS + index), str(START_NS - index))
        assert same(values_of(message), line["message"]), line
