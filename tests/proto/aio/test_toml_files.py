"""Files of options: one printable line for every fault."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from proto.aio.toml_files import MAX_FILE_BYTES, read_toml, unknown_option
from proto.errors import CallboardError

if TYPE_CHECKING:
    from pathlib import Path


class WrongError(CallboardError, ValueError):
    """What is wrong with a file."""


def half(table: dict[str, object]) -> int:
    """Return half of an option."""
    value = table["size"]
    if not isinstance(value, int):
        raise WrongError("size must be an integer")
    return value // 2


def test_the_table_of_a_file_is_handed_over(tmp_path: Path) -> None:
    """What the function returns is returned."""
    path = tmp_path / "some.toml"
    path.write_text("size = 8")
    assert read_toml(path, half, WrongError) == 4


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"size = true\nsize = 1", " is not TOML: "),
        (b"size = '1'", ": size must be an integer"),
        (b"\xff", " is not TOML: "),
        (b"size = " + b"[" * 5000, ": arrays or tables are nested too deeply"),
        (b"#" * (MAX_FILE_BYTES + 1), f": it is longer than {MAX_FILE_BYTES} bytes"),
    ],
    ids=["syntax", "value", "bytes", "nesting", "length"],
)
def test_an_error_begins_with_the_path(tmp_path: Path, content: bytes, said: str) -> None:
    """Whoever finds the fault: the parser, the reader or the caller's function."""
    path = tmp_path / "some.toml"
    path.write_bytes(content)
    with pytest.raises(WrongError) as caught:
        read_toml(path, half, WrongError)
    assert str(caught.value).startswith(f"{path}{said}")
    assert str(caught.value).isprintable()


def test_a_file_that_is_missing_is_named(tmp_path: Path) -> None:
    """With the system's reason."""
    with pytest.raises(WrongError, match=r"^Cannot read .*none.toml: No such file"):
        read_toml(tmp_path / "none.toml", half, WrongError)


def test_a_key_that_is_no_option_has_a_remedy() -> None:
    """The most similar option, or what the caller says."""
    assert unknown_option("sice", ["size"], "see --help") == "there is no option 'sice'; did you mean 'size'?"
    assert unknown_option("\x1b[2J", ["size"], "see --help") == r"there is no option '\x1b[2J'; see --help"
