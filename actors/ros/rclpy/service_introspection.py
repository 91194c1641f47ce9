"""callboard's states of service introspection, under rclpy's name."""

from __future__ import annotations

from actors.endpoints.service_introspection import ServiceIntrospectionState as ServiceIntrospectionState
