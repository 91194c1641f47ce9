"""RIHS01, the hash of a type: the SHA-256 of its definition (docs/protocol.md §10.6)."""

from __future__ import annotations

import hashlib


def hash_of(definition: bytes) -> str:
    """Return the RIHS01 hash of a canonical definition: "RIHS01_…", 71 characters."""
    return f"RIHS01_{hashlib.sha256(definition).hexdigest()}"
