"""Reads TOML files with options, for the daemon and for commands of `actors`.

Every fault is an error of the caller's class with one printable line that begins with the path, or with the
reason why the file cannot be read.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, TypeVar

from proto.untrusted_text import escape

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable
    from pathlib import Path

    from proto.errors import CallboardError

MAX_FILE_BYTES: Final = 1024 * 1024
"""Far above what all options with their comments need; a device would never end."""
_SHOWN: Final = 60
"""Characters of a wrong key in an error."""

T = TypeVar("T")


def read_toml(path: Path, read: Callable[[dict[str, Any]], T], error_class: type[CallboardError]) -> T:
    """Return what a function makes of a TOML file.

    Args:
        path: The file.
        read: Gets the file's table; raises `error_class` for what is wrong in it.
        error_class: The class of all errors.

    Raises:
        CallboardError: Of the given class: the file cannot be read, is longer than MAX_FILE_BYTES or is not
            TOML, or `read` raised it.
    """
    import tomllib  # noqa: PLC0415 - most callers have no file

    try:
        with path.open("rb") as file:
            content = file.read(MAX_FILE_BYTES + 1)
        if len(content) > MAX_FILE_BYTES:
            raise error_class(f"it is longer than {MAX_FILE_BYTES} bytes")
        return read(tomllib.loads(content.decode()))
    except OSError as error:
        raise error_class(f"Cannot read {path}: {error.strerror or error}") from error
    except error_class as error:  # before ValueError, of which it may be one
        raise error_class(f"{path}: {error}") from None
    except RecursionError:
        raise error_class(f"{path}: arrays or tables are nested too deeply") from None
    except ValueError as error:
        raise error_class(f"{path} is not TOML: {escape(str(error))}") from error


def unknown_option(key: str, known: Iterable[str], remedy: str) -> str:
    """Return the text of an error about a key that is no option.

    Args:
        key: The key; any text.
        known: The names of all options.
        remedy: What to do if no option has a similar name, such as "see callboard broker --help".
    """
    from difflib import get_close_matches  # noqa: PLC0415 - only after a mistake

    close = get_close_matches(key, list(known), n=1)
    suggestion = f"did you mean '{close[0]}'?" if close else remedy
    return f"there is no option '{escape(key)[:_SHOWN]}'; {suggestion}"
