"""The command line agrees with what ROS 2's verbs do, as far as rclpy and the messages decide it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from actors.cli.parsing import QOS_POLICIES, QOS_PRESETS
from actors.interfaces.catalog import standard_packages
from actors.interfaces.registry import find_interface
from tests.real_ros.differences import agree
from tests.real_ros.programs.message_types import PARTS

if TYPE_CHECKING:
    from tests.real_ros.sides import Side


@pytest.mark.parametrize(
    "text", [None, "", "0", "5", "101", "007", "010", "08", "0x5", "+7", " 5", "5a", "a", "-1", "233", "1e2"]
)
def test_the_domain_of_the_environment(text: str | None, real: Side, face: Side) -> None:
    """ROS_DOMAIN_ID chooses it for programs written for ROS 2."""
    truth, answer = (side.ask("command_line.domain", text) for side in (real, face))
    agree("domain", str(text), real=truth.outcome, callboard=answer.outcome)


def test_the_words_of_qos_options(real: Side) -> None:
    """The same presets and policies, in the same order."""
    for name, keys in real.call("command_line.qos_keys").items():
        choices = QOS_PRESETS if name == "profile" else QOS_POLICIES[name]
        agree("qos word", name, real=keys, callboard=list(choices))


def test_messages_as_verbs_print_them(real: Side) -> None:
    """`topic pub`, `service call` and `action send_goal` print messages as Python does."""
    packages = standard_packages()
    names = [each for each in real.call("message_types.names") if each.split("/")[0] in packages]
    assert names
    for name in names:
        found: Any = find_interface(name)
        parts = [getattr(found, part) if part else found for part in PARTS[name.split("/")[1]]]
        agree(
            "printed message",
            name,
            real=real.call("command_line.shown", name),
            callboard=[repr(part()) for part in parts],
        )
