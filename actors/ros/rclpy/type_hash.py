"""Hashes of types."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, TypedDict

_SIZE: Final = 32


class TypeHashDictionary(TypedDict):
    """The fields of a hash."""

    version: int
    value: bytes


@dataclass(slots=True)
class TypeHash:
    """The hash of a type; `str` returns ROS 2's text, "INVALID" for an unknown one."""

    version: int = -1
    value: bytes = bytes(_SIZE)

    __hash__ = None  # type: ignore[assignment]

    @classmethod
    def from_text(cls, text: str) -> TypeHash:
        """Return the hash of a string such as "RIHS01_…"; that of any other text is invalid."""
        prefix, _, digits = text.partition("_")
        if not (prefix.startswith("RIHS") and digits):
            return cls()
        return cls(int(prefix.removeprefix("RIHS")), bytes.fromhex(digits))

    def __str__(self) -> str:
        if self.version <= 0 or len(self.value) != _SIZE:
            return "INVALID"
        return f"RIHS{self.version:02}_{self.value.hex()}"
