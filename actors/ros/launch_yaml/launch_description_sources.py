"""Launch files in YAML."""

from __future__ import annotations

from actors.launch import AnyLaunchDescriptionSource

YAMLLaunchDescriptionSource = AnyLaunchDescriptionSource
