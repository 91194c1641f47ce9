"""Former names of attributes, which work for one version."""

from __future__ import annotations

import warnings
from typing import Any


def former_name(old: str, new: str) -> Any:
    """Return a property that reads another attribute, and warns.

    Args:
        old: The name of the property.
        new: The present name.
    """

    def get(owner: object) -> object:
        kind = type(owner).__name__
        warnings.warn(f"{kind}.{old} is called {kind}.{new}", DeprecationWarning, stacklevel=2)
        return getattr(owner, new)

    return property(get, doc=f"The former name of `{new}`.")
