"""Values of options: what is taken, and what is refused."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

import pytest

from actors.cli import parsing
from actors.qos.profile import (
    DurabilityPolicy,
    HistoryPolicy,
    LivelinessPolicy,
    QoSPresetProfiles,
    ReliabilityPolicy,
)

if TYPE_CHECKING:
    from collections.abc import Callable


@pytest.mark.parametrize(
    ("read", "text", "value"),
    [
        (parsing.domain, "0", 0),
        (parsing.domain, "232", 232),
        (parsing.count, "1", 1),
        (parsing.count_or_zero, "0", 0),
        (parsing.positive, "0.5", 0.5),
        (parsing.positive, "1e3", 1000.0),
    ],
)
def test_numbers_are_read(read: Callable[[str], float], text: str, value: float) -> None:
    """The limits are among what is taken."""
    assert read(text) == value


@pytest.mark.parametrize(
    ("read", "text"),
    [
        (parsing.domain, "233"),
        (parsing.domain, "-1"),
        (parsing.domain, "٣"),
        (parsing.count, "0"),
        (parsing.count, "1.5"),
        (parsing.count_or_zero, "-1"),
        (parsing.positive, "0"),
        (parsing.positive, "-1"),
        (parsing.positive, "nan"),
        (parsing.positive, "inf"),
        (parsing.positive, "fast"),
    ],
)
def test_other_numbers_are_refused(read: Callable[[str], float], text: str) -> None:
    """The text says what was expected and what was there."""
    with pytest.raises(argparse.ArgumentTypeError, match=f"expected .*, got '{text}'"):
        read(text)


def test_options_are_not_abbreviated() -> None:
    """--tim may mean something else in the next version."""
    parser = parsing.Parser(prog="x")
    parser.add_argument("--timeout")
    with pytest.raises(SystemExit) as stop:
        parser.parse_args(["--tim", "1"])
    assert stop.value.code == 2


def test_every_policy_and_preset_is_a_choice() -> None:
    """The names in the parser, which imports no policies, are theirs, in their order."""
    assert list(parsing.QOS_PRESETS) == QoSPresetProfiles.short_keys()
    assert {name: list(keys) for name, keys in parsing.QOS_POLICIES.items()} == {
        "history": HistoryPolicy.short_keys(),
        "reliability": ReliabilityPolicy.short_keys(),
        "durability": DurabilityPolicy.short_keys(),
        "liveliness": LivelinessPolicy.short_keys(),
    }
