"""What a broker's options make of its Zenoh session, and which of them are refused."""

from __future__ import annotations

import json
import subprocess
import sys
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from broker import BrokerOptions, InvalidOptionError, UnprotectedError
from broker.errors import ConfigurationError
from broker.mesh.engine.zenoh_config import connect_endpoints, make_config
from proto.extras import install_command


def value(options: BrokerOptions, key: str) -> Any:
    """Return what the configuration has under a key."""
    return json.loads(make_config(options).get_json(key))


def test_a_broker_is_a_router_that_searches_for_nobody() -> None:
    """It listens and connects where its options say, and nowhere else."""
    options = BrokerOptions(mesh="tcp/127.0.0.1:1, tcp/[::1]:2", mesh_lease_sec=1.5)
    assert value(options, "mode") == "router"
    assert value(options, "listen/endpoints") == []
    assert connect_endpoints(make_config(options)) == ["tcp/127.0.0.1:1", "tcp/[::1]:2"]
    assert value(options, "scouting/multicast/enabled") is False
    assert value(options, "scouting/gossip/enabled") is False
    assert value(options, "transport/link/tx/lease") == 1500
    assert value(options, "transport/shared_memory/enabled") is False


def test_a_received_message_has_a_limit(tmp_path: Path) -> None:
    """Case 68: that of the largest message or snapshot, unless a file of Zenoh has another one."""
    key, mib = "transport/link/rx/max_message_size", 1024 * 1024
    assert value(BrokerOptions(mesh="tcp/127.0.0.1:1"), key) == 65 * mib
    assert value(BrokerOptions(mesh="tcp/127.0.0.1:1", max_message_bytes=mib), key) == 65 * mib
    large = BrokerOptions(mesh="tcp/127.0.0.1:1", max_message_bytes=200 * mib, max_reassembly_bytes=200 * mib)
    assert value(large, key) == 201 * mib
    path = tmp_path / "zenoh.json5"
    path.write_text("{transport: {link: {rx: {max_message_size: 1000}}}}")
    assert value(BrokerOptions(mesh_config=path), key) == 1000


def test_a_file_of_zenoh_takes_precedence_over_the_defaults(tmp_path: Path) -> None:
    """What it does not say is as without it."""
    path = tmp_path / "zenoh.json5"
    path.write_text("{scouting: {multicast: {enabled: true}}, connect: {endpoints: ['tcp/127.0.0.1:9']}}")
    options = BrokerOptions(mesh_config=path, insecure=True)
    assert value(options, "scouting/multicast/enabled") is True
    assert value(options, "scouting/gossip/enabled") is False
    assert connect_endpoints(make_config(options)) == ["tcp/127.0.0.1:9"]
    assert value(options, "listen/endpoints") == []


@pytest.mark.parametrize(
    "endpoint", ["tcp/0.0.0.0:7447", "tcp/robot:7447", "tls/[::]:7447", "udp/192.168.0.2:7447?rel=0"]
)
def test_others_must_have_a_password_beyond_loopback(endpoint: str, tmp_path: Path) -> None:
    """Whether the broker listens there or connects; --insecure and --mesh-auth are the ways out."""
    for options in (BrokerOptions(mesh_listen=endpoint), BrokerOptions(mesh=endpoint)):
        with pytest.raises(UnprotectedError, match=r"--mesh-auth FILE .* --insecure"):
            make_config(options)
        make_config(replace(options, insecure=True))
        make_config(replace(options, mesh_auth=auth_file(tmp_path, "a:b\n")))


@pytest.mark.parametrize("endpoint", ["tcp/127.0.0.1:7447", "tcp/localhost:7447", "tcp/[::1]:7447"])
def test_loopback_needs_no_password(endpoint: str) -> None:
    """Other machines cannot connect there."""
    make_config(BrokerOptions(mesh_listen=endpoint))


@pytest.mark.parametrize(
    ("protection", "option"),
    [
        ({"auth": Path("rules.toml")}, "--auth"),
        ({"tls_client_ca": Path("ca"), "tls_cert": Path("cert"), "tls_key": Path("key")}, "--tls-client-ca"),
        ({"unix": Path("socket")}, "--unix"),
    ],
)
@pytest.mark.parametrize(
    "endpoint", ["tcp/127.0.0.1:7447", "tcp/localhost:7447", "unixsock-stream//tmp/mesh"]
)
def test_a_broker_that_lets_in_no_stranger_needs_credentials_on_loopback_too(
    protection: dict[str, Any], option: str, endpoint: str, tmp_path: Path
) -> None:
    """Case 63: another user of the machine could take part in the mesh beside the rules; two ways out."""
    for options in (BrokerOptions(mesh_listen=endpoint), BrokerOptions(mesh=endpoint)):
        make_config(options)
        protected = replace(options, **protection)
        with pytest.raises(UnprotectedError, match=rf"{option} says\. .*--mesh-auth FILE .* --insecure"):
            make_config(protected)
        make_config(replace(protected, insecure=True))
        make_config(replace(protected, mesh_auth=auth_file(tmp_path, "a:b\n")))


def test_certificates_of_clients_are_credentials_on_loopback(tmp_path: Path) -> None:
    """Case 63: mutual TLS in a configuration of Zenoh, on an encrypted endpoint only."""
    path = tmp_path / "zenoh.json5"
    for protocol in ("tls", "tcp"):
        path.write_text(
            f"{{listen: {{endpoints: ['{protocol}/127.0.0.1:1']}},"
            " transport: {link: {tls: {enable_mtls: true}}}}"
        )
        options = BrokerOptions(mesh_config=path, auth=tmp_path / "rules.toml")
        with nullcontext() if protocol == "tls" else pytest.raises(UnprotectedError, match="--auth says"):
            make_config(options)


@pytest.mark.parametrize(
    ("text", "protected"),
    [
        ("listen: {endpoints: ['tls/0.0.0.0:1']}, transport: {link: {tls: {enable_mtls: true}}}", True),
        ("listen: {endpoints: ['tcp/0.0.0.0:1']}, transport: {link: {tls: {enable_mtls: true}}}", False),
        ("listen: {endpoints: {router: ['tcp/0.0.0.0:1']}}", False),
        ("listen: {endpoints: {router: ['tcp/127.0.0.1:1']}}", True),
        ("connect: {endpoints: ['tcp/10.0.0.1:1']}", False),
        ("scouting: {multicast: {enabled: true}}", False),
        ("scouting: {gossip: {enabled: true}}", False),
        ("connect: {endpoints: ['tcp/a:1']}, transport: {auth: {usrpwd: {user: 'a', password: 'b'}}}", True),
    ],
)
def test_files_of_zenoh_are_held_to_it_too(text: str, *, protected: bool, tmp_path: Path) -> None:
    """Certificates protect encrypted connections only, and scouting finds anybody."""
    path = tmp_path / "zenoh.json5"
    path.write_text(f"{{{text}}}")
    if protected:
        make_config(BrokerOptions(mesh_config=path))
    else:
        with pytest.raises(UnprotectedError, match="--insecure"):
            make_config(BrokerOptions(mesh_config=path))
        make_config(BrokerOptions(mesh_config=path, insecure=True))


def test_errors_do_not_show_passwords_of_files(tmp_path: Path) -> None:
    """Case 33: Zenoh shows the whole configuration if it is invalid."""
    path = tmp_path / "zenoh.json5"
    path.write_text("{transport: {auth: {usrpwd: {password: 'secret'}}}}")
    with pytest.raises(ConfigurationError) as raised:
        make_config(BrokerOptions(mesh_config=path))
    assert str(raised.value) == f"Cannot use {path} (--mesh-config): Invalid configuration"


def test_endpoints_of_a_file_are_kept(tmp_path: Path) -> None:
    """Also those for a mode, as Zenoh's defaults are."""
    path = tmp_path / "zenoh.json5"
    path.write_text(
        "{listen: {endpoints: {router: ['tcp/127.0.0.1:7500']}}, transport: {link: {tx: {lease: 5}}}}"
    )
    options = BrokerOptions(mesh_config=path)
    assert value(options, "listen/endpoints") == {"router": ["tcp/127.0.0.1:7500"]}
    assert value(options, "transport/link/tx/lease") == 5


def auth_file(folder: Path, text: str, mode: int = 0o600) -> Path:
    """Write a file of users and passwords."""
    path = folder / "auth"
    path.write_text(text)
    path.chmod(mode)
    return path


def test_the_first_user_is_what_a_broker_joins_with(tmp_path: Path) -> None:
    """A password may have colons. All lines may join this broker."""
    path = auth_file(tmp_path, "robot:se:cret\nguest:word\n")
    options = BrokerOptions(mesh_listen="tcp/0.0.0.0:1", mesh_auth=path)
    expected = {"user": "robot", "password": "se:cret", "dictionary_file": str(path)}
    assert value(options, "transport/auth/usrpwd") == expected


@pytest.mark.parametrize(
    ("text", "mode", "fault"),
    [
        ("", 0o600, "it is empty"),
        ("a:b\nc\n", 0o600, "line 2 is not 'user:password'"),
        (":b\n", 0o600, "line 1 is no"),
        ("a:b\n", 0o640, "chmod 600"),
    ],
)
def test_unusable_files_of_passwords_are_refused(text: str, mode: int, fault: str, tmp_path: Path) -> None:
    """The error names the file and the line."""
    options = BrokerOptions(mesh="tcp/127.0.0.1:1", mesh_auth=auth_file(tmp_path, text, mode))
    with pytest.raises(ConfigurationError, match=fault):
        make_config(options)


def test_unusable_options_are_refused(tmp_path: Path) -> None:
    """A malformed endpoint, a file that is missing or no configuration, a password without a mesh."""
    with pytest.raises(ConfigurationError, match=r"--mesh .*such as tcp/"):
        make_config(BrokerOptions(mesh="robot"))
    with pytest.raises(ConfigurationError, match=r"Cannot use .*missing"):
        make_config(BrokerOptions(mesh_config=tmp_path / "missing"))
    (tmp_path / "odd.json5").write_text("{listen: {endpointss: 1}}")
    with pytest.raises(ConfigurationError, match=r"unknown field `endpointss`") as caught:
        make_config(BrokerOptions(mesh_config=tmp_path / "odd.json5"))
    assert ".rs:" not in str(caught.value)
    with pytest.raises(InvalidOptionError, match="mesh_auth needs"):
        BrokerOptions(mesh_auth=tmp_path / "odd")


@pytest.mark.processes
def test_a_missing_extra_is_one_clear_line() -> None:
    """The broker says what to install, and does not start."""
    code = (
        "import sys; sys.modules['zenoh'] = None; sys.argv[1:] = ['--port=0', '--mesh=tcp/127.0.0.1:1'];"
        "import runpy; runpy.run_module('broker', run_name='__main__')"
    )
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, capture_output=True, text=True, timeout=30, check=False)
    assert done.returncode != 0
    assert done.stderr == f"A mesh of brokers needs Zenoh: {install_command('zenoh')}\n"
