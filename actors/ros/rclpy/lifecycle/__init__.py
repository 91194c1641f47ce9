"""Nodes with states, as rclpy's `LifecycleNode`. The states and the services are callboard's."""

from __future__ import annotations

from actors.lifecycle.states import LifecycleState as LifecycleState
from actors.lifecycle.states import TransitionCallbackReturn as TransitionCallbackReturn
from actors.ros.rclpy.lifecycle.managed_entity import ManagedEntity as ManagedEntity
from actors.ros.rclpy.lifecycle.managed_entity import SimpleManagedEntity as SimpleManagedEntity
from actors.ros.rclpy.lifecycle.node import LifecycleNode as LifecycleNode
from actors.ros.rclpy.lifecycle.node import LifecycleNodeMixin as LifecycleNodeMixin
from actors.ros.rclpy.lifecycle.publisher import LifecyclePublisher as LifecyclePublisher

Node = LifecycleNode
NodeMixin = LifecycleNodeMixin
Publisher = LifecyclePublisher
State = LifecycleState

__all__ = [
    "LifecycleNode",
    "LifecycleNodeMixin",
    "LifecyclePublisher",
    "LifecycleState",
    "ManagedEntity",
    "SimpleManagedEntity",
]
