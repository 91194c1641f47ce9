"""The options of a bridge, from a file and the command line."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from actors.bridges.errors import InvalidBridgeOptionError
from actors.bridges.options import BridgeOptions, load_options

if TYPE_CHECKING:
    from pathlib import Path

FILE = """
allow = ["/camera/**"]
deny = ["/camera/raw"]
namespace = "/robot1"
domain_id = 7
max_nodes = 10
max_endpoints = 100
lease_sec = 20

[depths]
"/camera/small" = 1
"/camera/**" = 5
"""


def test_a_file_and_the_command_line(tmp_path: Path) -> None:
    """A file has all options, and the command line replaces single ones."""
    file = tmp_path / "bridge.toml"
    file.write_text(FILE)
    options = load_options({"domain_id": 8, "deny": ("/x",)}, file)
    assert options == BridgeOptions(
        allow=("/camera/**",),
        deny=("/x",),
        namespace="/robot1",
        domain_id=8,
        depths=(("/camera/small", 1), ("/camera/**", 5)),
        max_nodes=10,
        max_endpoints=100,
        lease_sec=20,
    )
    assert options.rules.depth_of("/camera/small") == 1
    assert load_options({}) == BridgeOptions()


@pytest.mark.parametrize(
    ("content", "text"),
    [
        ("alow = []", "there is no option 'alow'; did you mean 'allow'?"),
        ("zzz = 1", "there is no option 'zzz'; the options are allow, deny, namespace, depths, domain_id"),
        ("allow = '/a'", "allow must be a list of patterns"),
        ("deny = [1]", "deny must be a list of patterns"),
        ("deny = ['a']", "deny: 'a' is not a pattern"),
        ("depths = []", "depths must be a table"),
        ("[depths]\n'/a' = 'x'", "depths: the depth of /a must be an integer from 1 to"),
        ("namespace = 1", "namespace must be a string"),
        ("namespace = '/a b'", "namespace: "),
        ("domain_id = 233", "domain_id must be an integer from 0 to 232, not 233"),
        ("domain_id = '7'", "domain_id must be an integer from 0 to 232, not '7'"),
        ("domain_id = true", "domain_id must be an integer from 0 to 232"),
        ("max_nodes = 1.5", "max_nodes must be an integer from 1 to"),
        ("lease_sec = 2", "lease_sec must be an integer from 3 to 300, not 2"),
        ("=", " is not TOML: "),
        ("allow = " + "[" * 5000, "nested too deeply"),
        ("# " + "x" * 1024 * 1024, "longer than"),
    ],
    ids=lambda value: value[:20],
)
def test_wrong_files(tmp_path: Path, content: str, text: str) -> None:
    """Each error names the file and the option, and says what is allowed."""
    file = tmp_path / "bridge.toml"
    file.write_text(content)
    with pytest.raises(InvalidBridgeOptionError) as caught:
        load_options({}, file)
    assert str(file) in str(caught.value)
    assert text in str(caught.value)


def test_a_file_that_is_missing(tmp_path: Path) -> None:
    """The error has the system's reason."""
    with pytest.raises(InvalidBridgeOptionError, match=r"^Cannot read .*none.toml: No such file"):
        load_options({}, tmp_path / "none.toml")


def test_a_wrong_value_of_the_command_line() -> None:
    """Values of the command line are checked as those of a file are."""
    with pytest.raises(InvalidBridgeOptionError, match="domain_id must be an integer"):
        load_options({"domain_id": -1})
