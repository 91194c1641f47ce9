"""The files in deploy/ fit the command line, and the tools that read them accept them."""

from __future__ import annotations

import json
import re
import shlex
import shutil
import subprocess
import sys
import tomllib
from dataclasses import replace
from pathlib import Path

import pytest

from actors.cli.parsing import parser_of
from actors.cli.table import VERBS, Verb
from actors.web.options import DEFAULT_PORT as PAGE_PORT
from broker.access.files import load_rules
from broker.access.origin import Origin
from broker.access.rules import Action
from broker.daemon.configuration import load_configuration
from broker.errors import ConfigurationError
from broker.options import BrokerOptions
from proto.wire.addresses import parse_address
from proto.wire.url import DEFAULT_PORT

ROOT = Path(__file__).resolve().parent.parent
DEPLOY = ROOT / "deploy"
UNIT = (DEPLOY / "callboard.service").read_text(encoding="utf-8")
DOCKERFILE = (DEPLOY / "Dockerfile").read_text(encoding="utf-8").replace("\\\n", " ")
GUIDE = (ROOT / "docs" / "how-to" / "deploy.md").read_text(encoding="utf-8")


def check_command(words: list[str]) -> None:
    """Check that a command is `callboard broker` with options that exist."""
    program, verb, *options = words
    assert (Path(program).name, verb) == ("callboard", "broker")
    broker = VERBS["broker"]
    assert isinstance(broker, Verb)
    parser_of("broker", broker).parse_args(options)
    assert "--insecure" not in options


def unit_values(key: str) -> list[str]:
    """Return the values of a key of the unit."""
    return re.findall(rf"^{key}=(.*)$", UNIT, re.MULTILINE)


def test_the_unit_runs_the_broker_in_a_sandbox() -> None:
    """Its command exists; it is watched, has no user of its own, no capabilities and a read-only system."""
    (command,) = unit_values("ExecStart")
    check_command(shlex.split(command))
    wanted = {
        "Type": "notify",
        "DynamicUser": "yes",
        "CapabilityBoundingSet": "",
        "NoNewPrivileges": "yes",
        "ProtectSystem": "strict",
        "RestrictAddressFamilies": "AF_INET AF_INET6 AF_UNIX",
        "ConfigurationDirectory": "callboard",
        "LimitCORE": "0",
    }
    assert {key: unit_values(key) for key in wanted} == {key: [value] for key, value in wanted.items()}
    assert unit_values("SystemCallFilter")[0] == "@system-service"
    assert int(unit_values("WatchdogSec")[0]) > 0
    assert "$MAINPID" in unit_values("ExecReload")[0]


@pytest.mark.processes
def test_systemd_accepts_the_unit(tmp_path: Path) -> None:
    """`systemd-analyze verify` finds nothing, and the exposure is what the guide says."""
    tool = shutil.which("systemd-analyze")
    if tool is None:
        pytest.skip("needs systemd-analyze")
    path = tmp_path / "callboard.service"
    path.write_text(re.sub(r"^ExecStart=\S+", f"ExecStart={sys.executable}", UNIT, flags=re.MULTILINE))
    done = subprocess.run([tool, "verify", str(path)], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    done = subprocess.run(
        [tool, "security", "--offline=true", "--no-pager", str(path)],
        capture_output=True,
        text=True,
        check=False,
    )
    if "--offline" in done.stderr:
        pytest.skip("needs the option --offline of systemd 250")
    (exposure,) = re.findall(r"exposure level for \S+: ([\d.]+)", done.stdout)
    (documented,) = re.findall(r"systemd-analyze security callboard` gives it ([\d.]+) of 10", GUIDE)
    assert float(exposure) <= float(documented)


def test_the_password_of_a_mesh_is_copied_for_the_brokers_user(tmp_path: Path) -> None:
    """The guide installs it for a group, which the broker refuses; the unit's command makes what it reads."""
    make_config = pytest.importorskip("broker.mesh.engine.zenoh_config").make_config
    (mode,) = re.findall(r"install -m (\d+) -g callboard-config /dev/stdin /etc/callboard/mesh\.auth", GUIDE)
    (table,) = re.findall(r"```toml\n(# broker\.toml\nmesh_listen.*?)```", GUIDE, re.DOTALL)
    (command,) = re.findall(r"^#ExecStartPre=(.*)$", UNIT, re.MULTILINE)
    for folder in ("etc", "run"):
        (tmp_path / folder / "callboard").mkdir(parents=True)
    installed = tmp_path / "etc" / "callboard" / "mesh.auth"
    installed.write_text("fleet:password\n")
    installed.chmod(int(mode, 8))
    options = BrokerOptions(mesh="tcp/127.0.0.1:1", mesh_auth=installed)
    with pytest.raises(ConfigurationError, match="chmod 600"):
        make_config(options)
    words = command.replace("%E", f"{tmp_path}/etc").replace("%t", f"{tmp_path}/run")
    subprocess.run(shlex.split(words), check=True)
    path = tmp_path / tomllib.loads(table)["mesh_auth"].lstrip("/")
    assert make_config(replace(options, mesh_auth=path))


def test_the_container_runs_the_broker_without_rights() -> None:
    """Its commands exist, its user is not root, and nothing in it opens the broker."""
    commands = [
        json.loads(each) for each in re.findall(r"(?:ENTRYPOINT|CMD) (\[.*\])$", DOCKERFILE, re.MULTILINE)
    ]
    health, entrypoint, options = commands
    check_command(health)
    check_command(entrypoint + options)
    assert health[2:4] == options  # both at the same address
    (user,) = re.findall(r"^USER (\d+):\d+$", DOCKERFILE, re.MULTILINE)
    assert int(user) > 0
    assert re.findall(r"^EXPOSE (.*)$", DOCKERFILE, re.MULTILINE) == [f"{DEFAULT_PORT} {PAGE_PORT} 7447"]
    (extras,) = re.findall(r"pip install --no-cache-dir '\.\[(.*)\]'", DOCKERFILE)
    assert set(extras.split(",")) == {"web", "zenoh"}  # what http and mesh in a configuration need
    assert "insecure" not in DOCKERFILE


def test_the_container_is_built_from_what_the_package_needs() -> None:
    """.dockerignore lets through the packages and the files that pyproject.toml names, and nothing else."""
    lines = (ROOT / ".dockerignore").read_text(encoding="utf-8").splitlines()
    kept = {line.removeprefix("!") for line in lines if line.startswith("!")}
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    packages = {
        each for each in project["tool"]["setuptools"]["packages"]["find"]["include"] if "." not in each
    }
    files = {project["project"]["readme"], *project["project"]["license-files"], "pyproject.toml"}
    assert "*" in lines
    assert kept == packages | files


def test_the_example_configuration_shows_the_defaults(tmp_path: Path) -> None:
    """It is accepted as it is; with its commented lines, too, it changes nothing."""
    text = (DEPLOY / "broker.toml").read_text(encoding="utf-8")
    path = tmp_path / "broker.toml"
    path.write_text(re.sub(r"^#(?=\w)", "", text, flags=re.MULTILINE), encoding="utf-8")
    shown = tomllib.loads(path.read_text(encoding="utf-8"))
    assert len(shown) > 8
    for file in (DEPLOY / "broker.toml", path):
        assert load_configuration({}, file).values() == load_configuration({}).values()


def test_the_configurations_of_the_page_and_the_mesh_are_accepted(tmp_path: Path) -> None:
    """Those of the guide, and the examples in the configuration; the container has what they need."""
    sections = re.findall(
        r"^## (?:With the page|In a mesh).*?^```toml\n(.*?)^```$", GUIDE, re.MULTILINE | re.DOTALL
    )
    assert len(sections) == 2
    shown = (DEPLOY / "broker.toml").read_text(encoding="utf-8")
    examples = "".join(re.findall(r"^# ((?:http|mesh|bridge)\w* = .*\n)", shown, re.MULTILINE))
    path = tmp_path / "broker.toml"
    found: list[set[str]] = []
    for text in (*sections, examples):
        path.write_text(text, encoding="utf-8")
        load_configuration({}, path)
        found.append({*tomllib.loads(text)})
    assert found[0] >= {"http", "http_token"} <= found[2]
    assert found[1] == {"mesh_listen", "mesh", "mesh_auth"} <= found[2]
    assert {"bridge", "bridge_config", "bridge_token"} <= found[2]


def test_the_unit_stops_the_broker_before_the_page() -> None:
    """A signal for the page's process, too, would let the broker start it again."""
    assert unit_values("KillMode") == ["mixed"]
    assert unit_values("#Environment") == ["CALLBOARD_TOKEN_FILE=%d/page.token"]
    assert "page.token:/etc/callboard/page.token" in unit_values("#LoadCredential")


@pytest.mark.parametrize(
    ("user", "address", "action", "name", "allowed"),
    [
        ("operator", "127.0.0.1", Action.PUBLISH, "/robot1/cmd_vel", True),
        ("robot1", "10.0.0.1", Action.NODE, "/robot1/arm/driver", True),
        ("robot1", "10.0.0.1", Action.NODE, "/robot2/driver", False),
        ("robot1", "10.0.0.1", Action.PUBLISH, "/robot1/pose", True),
        ("robot1", "10.0.0.1", Action.PUBLISH, "/robot1/cmd_vel", False),
        ("robot1", "10.0.0.1", Action.PUBLISH, "/rosout", True),
        ("robot1", "10.0.0.1", Action.SUBSCRIBE, "/robot2/pose", False),
        ("dashboard", "10.0.0.1", Action.SUBSCRIBE, "/robot2/pose", True),
        ("dashboard", "10.0.0.1", Action.SUBSCRIBE, "/robot1/camera/image", False),
        ("dashboard", "10.0.0.1", Action.PUBLISH, "/robot1/cmd_vel", False),
        ("dashboard", "8.8.8.8", Action.SUBSCRIBE, "/map", False),
        ("bridge1", "10.0.0.1", Action.NODE, "/ros2_bridge_7_b1f2", True),
        ("bridge1", "10.0.0.1", Action.NODE, "/robot1/arm/driver", True),
        ("bridge1", "10.0.0.1", Action.NODE, "/robot2/driver", False),
        ("bridge1", "10.0.0.1", Action.PUBLISH, "/robot1/pose", True),
        ("bridge1", "10.0.0.1", Action.PUBLISH, "/rosout", True),
        ("bridge1", "10.0.0.1", Action.PUBLISH, "/robot1/cmd_vel", False),
        ("bridge1", "10.0.0.1", Action.SUBSCRIBE, "/robot1/cmd_vel", True),
        ("bridge1", "10.0.0.1", Action.SUBSCRIBE, "/robot2/pose", False),
        ("bridge1", "10.0.0.1", Action.CALL, "/robot2/stop", False),
        ("bridge1", "10.0.0.1", Action.SERVE, "/ros2_bridge_7_b1f2/get_report", True),
        ("bridge1", "10.0.0.1", Action.ADMINISTER, "/", False),
        ("web", "127.0.0.1", Action.NODE, "/_callboard_web_1_0a", True),
        ("web", "127.0.0.1", Action.ADMINISTER, "/", True),
        ("web", "127.0.0.1", Action.PUBLISH, "/robot1/cmd_vel", False),
    ],
)
def test_the_example_rules_do_what_their_comments_say(
    user: str, address: str, action: Action, name: str, allowed: bool
) -> None:
    """Each user may do what its comment says, and not more."""
    rules = load_rules(DEPLOY / "rules.toml")
    principal = rules.principal(user, Origin(address=parse_address(address)))
    assert principal is not None
    assert principal.rights.may(action, name) is allowed


def test_nobody_connects_by_the_example_rules() -> None:
    """The example has no tokens, so that installing it lets in nobody."""
    rules = tomllib.loads((DEPLOY / "rules.toml").read_text(encoding="utf-8"))
    assert all(user["tokens"] == [] for user in rules["users"].values())
    assert "local" not in rules


def test_the_commands_of_the_guide_install_what_the_unit_uses() -> None:
    """The files that it installs exist, and have the names, the group and the folders of the unit."""
    commands = [shlex.split(line) for line in re.findall(r"^    (\S.*)$", GUIDE, re.MULTILINE)]
    installed = {words[-1]: words[-2] for words in commands if words[0] == "install" and "-d" not in words}
    assert all((ROOT / source).is_file() for source in installed.values())
    configuration = {f"/etc/callboard/{name}.toml" for name in ("broker", "rules")}
    assert set(installed) == {*configuration, "/etc/systemd/system/callboard.service"}
    (command,) = unit_values("ExecStart")
    assert "%E/callboard/broker.toml" in command
    (program, *_) = shlex.split(command)
    assert ["python3", "-m", "venv", str(Path(program).parent.parent)] in commands
    assert ["groupadd", "--system", *unit_values("SupplementaryGroups")] in commands
    (built,) = [words for words in commands if words[:2] == ["docker", "build"]]
    assert (ROOT / built[built.index("--file") + 1]).is_file()
