"""rosbag2's own compression, of whole files or of single messages, which is only read."""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Final

import zstandard

from actors.bags.errors import BagError, InvalidBagError
from actors.bags.storage.bag_file import open_regular
from actors.bags.storage.compression import CompressionError, decompress, most_expanded

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from actors.bags.contents.records import BagMessage
    from actors.bags.storage.bag_file import BagFile, FileContents, Filter, Order

ZSTD_MAGIC: Final = b"\x28\xb5\x2f\xfd"
_PIECE_BYTES: Final = 1024 * 1024


class CompressedMessages:
    """A file whose messages are compressed one by one: a `BagFile` with the decompressed messages.

    Args:
        file: The file.
        max_bytes: Limit for a decompressed message.
    """

    def __init__(self, file: BagFile, max_bytes: int) -> None:
        self._file = file
        self._max_bytes = max_bytes
        self.path = file.path

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def contents(self) -> FileContents:
        """Return a summary of the file."""
        return self._file.contents()

    def messages(self, chosen: Filter, order: Order) -> Iterator[BagMessage]:
        """Yield messages; see `BagFile.messages`."""
        for message in self._file.messages(chosen, order):
            try:
                most = min(self._max_bytes, most_expanded(len(message.data)))
                data = decompress("zstd", message.data, most)
            except CompressionError as error:
                place = f"topic {message.topic.name[:80]}, time {message.log_time_ns}"
                raise InvalidBagError(self.path, place, f"a message cannot be read: {error}") from None
            yield message._replace(data=data)


class _TemporaryFile:
    """A decompressed copy of a file, which `close` removes."""

    def __init__(self, path: Path, file: BagFile, folder: tempfile.TemporaryDirectory[str]) -> None:
        self.path = path
        self._file = file
        self._folder = folder

    def close(self) -> None:
        self._file.close()
        self._folder.cleanup()

    def contents(self) -> FileContents:
        return self._file.contents()

    def messages(self, chosen: Filter, order: Order) -> Iterator[BagMessage]:
        return self._file.messages(chosen, order)


def decompressed_file(path: Path, open_file: Callable[[Path], BagFile]) -> BagFile:
    """Decompress a file into a temporary folder, and open the copy. Closing it removes the copy.

    Args:
        path: The file.
        open_file: Opens the copy.

    Raises:
        BagError: The copy cannot be written, such as for lack of space.
        InvalidBagError: The file is damaged, or grows beyond `most_expanded`.
    """
    folder = tempfile.TemporaryDirectory(prefix="callboard-bag-")
    try:
        whole = Path(folder.name) / path.name.removesuffix(".zstd")
        _decompress(path, whole)
        return _TemporaryFile(path, open_file(whole), folder)
    except BaseException:
        folder.cleanup()
        raise


def _decompress(path: Path, target: Path) -> None:
    most = most_expanded(path.stat().st_size)
    most = min(most, shutil.disk_usage(target.parent).free // 2)
    size = 0
    with open_regular(path) as file, target.open("wb") as out:
        reader = zstandard.ZstdDecompressor(max_window_size=1 << 27).stream_reader(
            file, read_across_frames=True
        )
        try:
            while piece := reader.read(_PIECE_BYTES):
                size += len(piece)
                if size > most:
                    raise InvalidBagError(
                        path,
                        "",
                        f"it exceeds {most:,} bytes when decompressed; decompress it with: zstd -d",
                    )
                out.write(piece)
        except zstandard.ZstdError as error:
            raise InvalidBagError(path, "", f"it cannot be decompressed: {error}") from None
        except OSError as error:
            raise BagError(f"{target}: {error.strerror or error}") from None
