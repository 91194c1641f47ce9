# The part of msgpack's interface that callboard uses: the package ships no types.
from typing import Any

class UnpackException(Exception): ...
class OutOfData(UnpackException): ...

class ExtraData(ValueError):
    unpacked: Any
    extra: bytes

class ExtType:
    code: int
    data: bytes
    def __init__(self, code: int, data: bytes) -> None: ...

class Packer:
    def __init__(self, *, autoreset: bool = True) -> None: ...
    def pack(self, obj: object) -> bytes: ...

class Unpacker:
    def __init__(
        self,
        file_like: None = None,
        *,
        read_size: int = ...,
        use_list: bool = True,
        strict_map_key: bool = True,
        max_buffer_size: int = ...,
        max_str_len: int = -1,
        max_bin_len: int = -1,
        max_array_len: int = -1,
        max_map_len: int = -1,
        max_ext_len: int = -1,
    ) -> None: ...
    def feed(self, data: bytes | bytearray | memoryview) -> None: ...
    def unpack(self) -> Any: ...
    def tell(self) -> int: ...
    def read_bytes(self, nbytes: int) -> bytes: ...

def packb(obj: object) -> bytes: ...
def unpackb(
    packed: bytes | bytearray | memoryview,
    *,
    use_list: bool = True,
    strict_map_key: bool = True,
    max_str_len: int = -1,
    max_bin_len: int = -1,
    max_array_len: int = -1,
    max_map_len: int = -1,
    max_ext_len: int = -1,
) -> Any: ...
