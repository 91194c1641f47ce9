"""Reads ROS_DOMAIN_ID as rcl does. It imports nothing with I/O, because launch planning uses it."""

from __future__ import annotations

import re
from typing import Final

from proto.limits import MAX_DOMAIN

ROS_DOMAIN: Final = "ROS_DOMAIN_ID"
_C_NUMBER: Final = re.compile(r"\s*\+?(0[xX][0-9a-fA-F]{1,9}|0[0-7]{0,9}|[1-9][0-9]{0,9})")
"""A number as C reads it."""


def parse_ros_domain(text: str) -> int | None:
    """Return the domain that a text names. As in rcl, 0x10 is 16, and 010 is 8.

    Args:
        text: The value of ROS_DOMAIN_ID.

    Returns:
        The domain; None if the text is not a number from 0 to `MAX_DOMAIN`.
    """
    found = _C_NUMBER.fullmatch(text)
    if found is None:
        return None
    digits = found[1]
    number = int(digits, 8 if digits[0] == "0" and digits[1:].isdecimal() else 0)
    return number if number <= MAX_DOMAIN else None
