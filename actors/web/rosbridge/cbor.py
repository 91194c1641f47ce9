"""Operations and messages in CBOR (RFC 8949), with typed arrays (RFC 8746). Pure.

The library is in the extra `web`, and imported when the first client asks for CBOR.
"""

from __future__ import annotations

import array
from typing import TYPE_CHECKING, Any, Final

from actors.interfaces.arrays import BIG_ENDIAN, NumericArray
from actors.web.rosbridge.operations import OperationError
from actors.web.rosbridge.values import plain

if TYPE_CHECKING:
    from collections.abc import Mapping

    from actors.interfaces.message import Message

_TAGS: Final = {
    "uint16": 69, "uint32": 70, "uint64": 71,
    "int8": 72, "int16": 77, "int32": 78, "int64": 79,
    "float32": 85, "float64": 86,
}  # fmt: skip
"""The tags of little-endian arrays."""


def require_cbor() -> None:
    """Raise OperationError if the library is missing."""
    try:
        import cbor2  # noqa: F401, PLC0415  # pyright: ignore[reportUnusedImport]
    except ImportError:
        text = "This server has no CBOR: install the package cbor2, which is in the extra callboard[web]"
        raise OperationError(text) from None


def encode_cbor(operation: Mapping[str, Any]) -> bytes:
    """Return an operation as CBOR.

    Args:
        operation: Its fields.
    """
    import cbor2  # noqa: PLC0415 - see above

    return cbor2.dumps(operation)


def cbor_values(message: Message | Mapping[str, Any]) -> Any:
    """Return a message for `encode_cbor`: sequences of numbers are typed arrays, and `uint8[]` is bytes.

    Args:
        message: A message, or the dict of a message of unknown type.
    """
    return plain(message, _typed_array, bytes)


def _typed_array(numbers: NumericArray) -> Any:
    import cbor2  # noqa: PLC0415 - see above

    if BIG_ENDIAN:
        swapped = array.array(numbers.typecode, numbers)
        swapped.byteswap()
        return cbor2.CBORTag(_TAGS[numbers.element], swapped.tobytes())
    return cbor2.CBORTag(_TAGS[numbers.element], numbers.tobytes())
