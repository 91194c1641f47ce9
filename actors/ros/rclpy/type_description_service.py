"""The name of the parameter that switches a node's service for descriptions of types."""

from __future__ import annotations

from typing import Final

START_TYPE_DESCRIPTION_SERVICE_PARAM: Final = "start_type_description_service"
