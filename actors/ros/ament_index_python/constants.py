"""Names of the index."""

from __future__ import annotations

from typing import Final

from actors.tools.prefixes import INDEX

AMENT_PREFIX_PATH_ENV_VAR: Final = "AMENT_PREFIX_PATH"
RESOURCE_INDEX_SUBFOLDER: Final = str(INDEX)
