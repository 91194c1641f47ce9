"""What the command line of ROS 2 prints and reads, as far as rclpy and the messages decide it."""

from __future__ import annotations

import os
from importlib import import_module

import rclpy
from rclpy import qos

from tests.real_ros.programs.message_types import PARTS

VARIABLE = "ROS_DOMAIN_ID"


def domain(text):
    """Return the domain of a context, with ROS_DOMAIN_ID; None: without it."""
    before = os.environ.pop(VARIABLE, None)
    if text is not None:
        os.environ[VARIABLE] = text
    context = rclpy.Context()
    try:
        context.init([])
        number = context.get_domain_id()
        context.shutdown()
    finally:
        os.environ.pop(VARIABLE, None)
        if before is not None:
            os.environ[VARIABLE] = before
    return number


def qos_keys():
    """Return the words that the options for QoS take."""
    policies = {
        "history": qos.QoSHistoryPolicy,
        "reliability": qos.QoSReliabilityPolicy,
        "durability": qos.QoSDurabilityPolicy,
        "liveliness": qos.QoSLivelinessPolicy,
    }
    keys = {name: policy.short_keys() for name, policy in policies.items()}
    return {"profile": qos.QoSPresetProfiles.short_keys(), **keys}


def shown(name):
    """Return what `topic pub`, `service call` and `action send_goal` print of messages with defaults."""
    package, kind, word = name.split("/")
    owner = getattr(import_module(f"{package}.{kind}"), word)
    return [repr((getattr(owner, part) if part else owner)()) for part in PARTS[kind]]
