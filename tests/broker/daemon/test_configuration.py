"""The daemon's configuration: a file, the command line and the defaults."""

from __future__ import annotations

import os
import re
import tomllib
from dataclasses import fields
from pathlib import Path

import pytest

from broker import BrokerOptions, InvalidOptionError
from broker.daemon.configuration import SETTINGS, Configuration, load_configuration
from broker.errors import ConfigurationError
from broker.options import DaemonOptions
from proto.aio.toml_files import MAX_FILE_BYTES


def load(folder: Path, text: str, **given: object) -> Configuration:
    """Load a file with this text."""
    path = folder / "broker.toml"
    path.write_text(text, encoding="utf-8")
    return load_configuration(given, path)


def test_without_a_file_everything_has_its_default() -> None:
    """The configuration of nothing is that of a broker without options."""
    found = load_configuration({})
    assert (found.broker_options, found.daemon_options) == (BrokerOptions(), DaemonOptions())
    assert set(found.sources.values()) == {"default"}


def test_the_command_line_beats_the_file_and_the_file_the_defaults(tmp_path: Path) -> None:
    """Each value is known with its source."""
    found = load(tmp_path, 'port = 1\nhost = "::1"\nlog_level = "debug"\n', port=2)
    options = found.broker_options
    assert (options.port, options.host, options.keepalive_sec) == (2, "::1", 3.0)
    assert found.daemon_options.log_level == "debug"
    file = str(tmp_path / "broker.toml")
    sources = [found.sources[name] for name in ("port", "host", "keepalive_sec")]
    assert sources == ["command line", file, "default"]


def test_paths_in_a_file_begin_at_its_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A relative path does not depend on where the broker is started; `~` is the home folder."""
    monkeypatch.setenv("HOME", "/home/robot")
    found = load(tmp_path, 'unix = "run/s"\nurl_file = "~/url"\n')
    assert found.broker_options.unix == tmp_path / "run" / "s"
    assert found.daemon_options.url_file == Path("/home/robot/url")


def test_every_option_of_the_broker_can_be_configured(tmp_path: Path) -> None:
    """Each field of the options is a key that accepts its own default, or a path where there is none."""
    assert list(SETTINGS) == [each.name for kind in (BrokerOptions, DaemonOptions) for each in fields(kind)]
    for setting in SETTINGS.values():
        value = "x" if setting.default is None and setting.kind is Path else setting.default
        if value is not None:
            assert setting.read(value, Path("/etc")) == (Path("/etc/x") if value == "x" else value)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("prot = 1", "there is no option 'prot'; did you mean 'port'?"),
        ("keepalive-sec = 1", "there is no option 'keepalive-sec'; did you mean 'keepalive_sec'?"),
        ("zzz = 1", "there is no option 'zzz'; see callboard broker --help"),
        ("[port]", "port must be an integer from 0 to 65535, not {}"),
        ('port = "1"', 'port must be an integer from 0 to 65535, not "1"'),
        ("port = true", "port must be an integer from 0 to 65535, not true"),
        ("port = 1.0", "port must be an integer from 0 to 65535, not 1.0"),
        ("port = 70000", "port must be an integer from 0 to 65535, not 70000"),
        ("keepalive_sec = nan", "keepalive_sec must be a number from 0.1 to 3600, not nan"),
        ("json_logs = 1", "json_logs must be true or false, not 1"),
        ('log_level = "loud"', 'log_level must be one of "debug", "info", "warning", "error", not "loud"'),
        ("log_level = 1", 'log_level must be one of "debug", "info", "warning", "error", not 1'),
        ('unix = ""', 'unix must be a string with a path, not ""'),
        ('host = ["a"]', "host must be a string, not ['a']"),
        ("exit_when_idle = 0", "exit_when_idle must be a number from 0.1 to 86400, not 0"),
    ],
)
def test_a_wrong_file_is_one_line_with_file_key_and_what_is_allowed(
    text: str, said: str, tmp_path: Path
) -> None:
    """The error names the file, the key, what is allowed, and what was probably meant."""
    with pytest.raises(ConfigurationError) as caught:
        load(tmp_path, text)
    assert str(caught.value) == f"{tmp_path / 'broker.toml'}: {said}"


def test_the_page_has_keys_of_the_file(tmp_path: Path) -> None:
    """As every option of `callboard broker`; the file with its token is relative to the folder."""
    text = 'http = "0.0.0.0:7412"\nhttp_token = "web.token"\nhttp_allow_control = true\n'
    options = load(tmp_path, text).daemon_options
    assert (options.http, options.http_token) == ("0.0.0.0:7412", tmp_path / "web.token")
    assert options.http_allow_control


def test_the_bridge_has_keys_of_the_file(tmp_path: Path) -> None:
    """Its own files are relative to the folder."""
    text = 'bridge = "ros2"\nbridge_config = "bridge.toml"\nbridge_token = "bridge.token"\n'
    options = load(tmp_path, text).daemon_options
    assert options.bridge == "ros2"
    assert (options.bridge_config, options.bridge_token) == (
        tmp_path / "bridge.toml",
        tmp_path / "bridge.token",
    )


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"http_url": "callboard://robot"}, "http_url needs http, the address of the page"),
        ({"http_token": Path("t")}, "http_token needs http, the address of the page"),
        ({"http_allow_control": True}, "http_allow_control needs http, the address of the page"),
        ({"http": "a:1", "exit_when_idle": 1.0}, "exit_when_idle cannot be used with http: the page stays"),
        ({"bridge_config": Path("b.toml")}, "bridge_config needs bridge, the network to bridge"),
        (
            {"bridge_url": "callboard://robot", "http": "a:1"},
            "bridge_url needs bridge, the network to bridge",
        ),
        ({"bridge_token": Path("t")}, "bridge_token needs bridge, the network to bridge"),
        (
            {"bridge": "ros2", "exit_when_idle": 1.0},
            "exit_when_idle cannot be used with bridge: the bridge stays",
        ),
    ],
)
def test_options_of_the_page_and_the_bridge_without_effect_are_errors(
    options: dict[str, object], said: str
) -> None:
    """They would mislead."""
    with pytest.raises(InvalidOptionError, match=said):
        load_configuration(options)


def test_every_flag_of_the_command_is_a_key_of_the_file() -> None:
    """Except those about the file itself, as the guide says."""
    reference = Path(__file__).resolve().parents[3] / "docs" / "reference" / "cli.md"
    section = reference.read_text(encoding="utf-8").split("\n## callboard broker\n")[1].split("\n## ")[0]
    flags = re.findall(r"^\| `--([a-z-]+)", section, re.MULTILINE)
    assert len(flags) > 40
    assert {flag.replace("-", "_") for flag in flags} ^ {*SETTINGS} == {
        "config",
        "print_config",
        "healthcheck",
    }


@pytest.mark.parametrize("text", ["port = ", "port = 1\nport = 2", "x = " + "[" * 5000, '"\x1b[2J" = 1\n'])
def test_what_is_no_toml_is_one_plain_line(text: str, tmp_path: Path) -> None:
    """Syntax errors, nesting without end and control characters of a terminal leave one printable line."""
    with pytest.raises(ConfigurationError) as caught:
        load(tmp_path, text)
    assert str(caught.value).startswith(str(tmp_path / "broker.toml"))
    assert str(caught.value).isprintable()


def test_a_file_that_cannot_be_read_is_one_plain_line(tmp_path: Path) -> None:
    """Missing files, folders, files without end, and bytes that are no text."""
    for path in (tmp_path / "missing", tmp_path):
        with pytest.raises(ConfigurationError, match=f"^Cannot read {path}: "):
            load_configuration({}, path)
    if Path("/dev/zero").exists():
        with pytest.raises(ConfigurationError, match=f"longer than {MAX_FILE_BYTES} bytes"):
            load_configuration({}, Path("/dev/zero"))
    (tmp_path / "bytes").write_bytes(b"\xff")
    with pytest.raises(ConfigurationError, match="bytes is not TOML"):
        load_configuration({}, tmp_path / "bytes")


def test_a_given_value_out_of_range_does_not_blame_the_file(tmp_path: Path) -> None:
    """The error is about the option of the command line."""
    with pytest.raises(InvalidOptionError, match=r"^port must be from 0 to 65535, got 70000$"):
        load(tmp_path, "port = 1", port=70_000)


def test_a_printed_configuration_is_a_file_with_the_same_values(tmp_path: Path) -> None:
    """Each option has its help, its range and its source; what is printed can be loaded."""
    odd = os.fsdecode(b'/tmp/"\\\x7f\n\xc3\xa4')
    found = load(
        tmp_path, "max_link_bytes = 70000\njson_logs = true\n", unix=Path(odd), keepalive_sec=1e9 / 1e6
    )
    text = found.to_toml()
    assert load(tmp_path, text).values() == found.values()
    assert set(tomllib.loads(text)) == {name for name, value in found.values().items() if value is not None}
    assert "# url_file is not set\n" in text
    assert f"\nmax_link_bytes = 70000  # {tmp_path / 'broker.toml'}\n" in text
    assert "\nkeepalive_sec = 1000.0  # command line\n" in text
    assert "# TCP port; 0 takes a free one (an integer from 0 to 65535)\nport = 7411  # default\n" in text
    assert "(a number from 0.1 to 86400; SIGHUP applies a change)\nsuspend_close_sec = 30.0" in text
