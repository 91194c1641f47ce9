"""Types that callboard makes from the share folder of real ROS 2 have rosidl's hashes."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

from actors.interfaces.catalog import standard_packages
from tests.real_ros import REAL_PYTHON

if TYPE_CHECKING:
    from tests.real_ros.sides import Side

SHARE = REAL_PYTHON.parent.parent / "share"


def test_every_type_has_the_hash_of_its_description(real: Side) -> None:
    """All packages, those that callboard does not bring, too, beside ROS 2's own classes in one process."""
    truth: dict[str, str] = {}
    for kind in ("msg", "srv", "action"):
        for file in SHARE.glob(f"*/{kind}/*.json"):
            described = json.loads(file.read_text(encoding="utf-8"))["type_hashes"]
            truth |= {each["type_name"]: each["hash_string"] for each in described}
    packages = {name.partition("/")[0] for name in truth}
    assert {"test_msgs", "rmw_dds_common"} <= packages - set(standard_packages())
    answer = real.call("share_packages.hashes")
    assert {name: answer.get(name) for name in truth} == truth
