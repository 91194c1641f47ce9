"""Launch files in XML."""

from __future__ import annotations

from actors.launch import AnyLaunchDescriptionSource

XMLLaunchDescriptionSource = AnyLaunchDescriptionSource
