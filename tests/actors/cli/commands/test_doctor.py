"""`callboard doctor` prints what was looked at, and its exit code says whether anything is wrong."""

from __future__ import annotations

import asyncio
import json
import re
import socket
import sys
from typing import TYPE_CHECKING

from actors.cli.commands.doctor import _verdict
from actors.cli.main import main
from actors.interfaces.std_msgs.msg import String
from actors.tools.check import Check

if TYPE_CHECKING:
    from pathlib import Path

    import pytest

    from tests.actors.cli.conftest import Desk


async def test_all_is_well_with_a_broker(desk: Desk, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each finding is one line; 0."""
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    ended = await desk.callboard("doctor")
    assert ended.code == 0
    assert ended.err == ""
    assert f"ok    broker        {desk.url} answers in " in ended.out


async def test_json_has_the_same(desk: Desk) -> None:
    """A list of checks."""
    ended = await desk.callboard("doctor", "--json")
    assert {tuple(check) for check in ended.json} == {("name", "status", "finding", "remedy")}
    assert "broker" in {check["name"] for check in ended.json}


async def test_the_broker_of_a_context_is_examined(
    desk: Desk, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """--context chooses it, and the finding names the context; an unknown one is a finding, too."""
    monkeypatch.delenv("CALLBOARD_URL", raising=False)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    main(["context", "add", "desk", "--url", desk.url])
    main(["context", "add", "nobody", "--url", "callboard+unix:///nowhere", "--use"])
    assert await asyncio.to_thread(main, ["doctor", "--context", "desk"]) == 0
    found = capsys.readouterr().out
    assert f"ok    broker        {desk.url} answers in " in found
    assert "(context 'desk')\n" in found
    assert await asyncio.to_thread(main, ["doctor", "--context", "unknown"]) == 1
    assert "'unknown'" in capsys.readouterr().out


def test_what_is_wrong_is_followed_by_what_to_do(capsys: pytest.CaptureFixture[str]) -> None:
    """Then the code is 1."""
    assert main(["doctor", "--url", "callboard+unix:///nowhere"]) == 1
    lines = capsys.readouterr().out.splitlines()
    at = lines.index("fail  broker        No broker at callboard+unix:///nowhere (--url)")
    assert lines[at + 1] == "                    Start one with: callboard broker --unix /nowhere"
    assert lines[-1].startswith("1 problem")


def test_the_files_of_a_brokers_configuration_are_checked(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A configuration that a broker would accept is fine; for another the finding says why it is not."""
    path = tmp_path / "broker.toml"
    for text, finding in (
        ("port = 1\n", f"ok    configuration  {path}"),
        ("prt = 1\n", "did you mean 'port'?"),
    ):
        path.write_text(text)
        assert main(["doctor", "--url", "callboard+unix:///nowhere", "--config", str(path)]) == 1
        assert finding in capsys.readouterr().out
    secrets = {"auth": "auth.toml", "mesh_auth": "mesh.auth", "http_token": "web.token"}
    secrets |= {"bridge_token": "bridge.token"}
    for name in secrets.values():
        (tmp_path / name).touch(mode=0o644)
    lines = [f'{key} = "{name}"\n' for key, name in secrets.items()]
    beside = 'http = "127.0.0.1:0"\nbridge = "ros2"\n'
    path.write_text(f'{beside}mesh_listen = "tcp/127.0.0.1:7447"\n{"".join(lines)}')
    main(["doctor", "--url", "callboard+unix:///nowhere", "--config", str(path)])
    printed = capsys.readouterr().out
    for key, name in secrets.items():
        assert f"{key}: {tmp_path / name} can be read or written by every user" in printed


def test_long_findings_are_wrapped_to_the_terminal(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nothing is cut off; what follows stands below the finding. Pipes get whole lines: see above."""
    url = "callboard+unix:///nowhere,callboard+unix:///nobody"
    monkeypatch.setenv("COLUMNS", "60")
    monkeypatch.setenv("NO_COLOR", "1")
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True)
    assert main(["doctor", "--url", url]) == 1
    lines = capsys.readouterr().out.splitlines()
    at = lines.index("fail  broker        No broker at callboard+unix:///nowhere,")
    assert lines[at + 1] == "                    callboard+unix:///nobody (--url)"
    assert all(len(line) <= 60 for line in lines[at:])
    assert all(line.startswith(" " * 20) for line in lines[at + 1 : -2])


def test_the_verdict_counts() -> None:
    """Problems and warnings; neither is well."""
    fine, odd, bad = Check("a", "ok", ""), Check("a", "warn", ""), Check("a", "fail", "")
    assert _verdict([fine]) == "All is well."
    assert _verdict([fine, odd]) == "Nothing is wrong; 1 warning."
    assert _verdict([bad]) == "1 problem."
    assert _verdict([bad, bad, odd]) == "2 problems, 1 warning."


def test_only_what_failed_is_printed(capsys: pytest.CaptureFixture[str]) -> None:
    """-rf leaves out the rest, in JSON, too; -iw makes warnings failures; -ep leaves out packages."""
    nowhere = ("--url", "callboard+unix:///nowhere")
    assert main(["doctor", "-rf", "--json", *nowhere]) == 1
    assert {check["status"] for check in json.loads(capsys.readouterr().out)} == {"fail"}
    assert main(["doctor", "-ep", "-r", "--json", *nowhere]) == 1
    assert not {"codec", "import names"} & {check["name"] for check in json.loads(capsys.readouterr().out)}
    assert main(["doctor", "--report-failed", "--include-warnings", *nowhere]) == 1
    assert not re.search("^(ok|warn) ", capsys.readouterr().out, re.MULTILINE)


async def test_warnings_as_failures(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    """An unknown variable is a warning; with -iw the exit code is 1."""
    monkeypatch.setenv("CALLBOARD_URLL", "x")
    without, with_warnings = [await desk.callboard("doctor", "-ep", *each) for each in ((), ("-iw",))]
    assert (without.code, with_warnings.code) == (0, 1)
    assert "fail  variables" in with_warnings.out


async def test_hello_counts_the_messages_of_others(desk: Desk) -> None:
    """ROS 2's table and text; its own messages do not count."""
    async with desk.node() as node:
        publisher = node.create_publisher(String, "canyouhearme", 10)
        heard = node.create_subscription(String, "canyouhearme", qos_profile=1000)
        node.create_timer(0.01, lambda: publisher.publish(String(data="hello, it's me robot")))
        ended = await desk.callboard("doctor", "hello", "--once", "-ep", "0.5")
        greetings = {(await anext(aiter(heard))).data for _ in range(heard.queued)}
    async with desk.node():
        alone = await desk.callboard("wtf", "hello", "-1", "-ep", "0.01", "--json")
    assert f"hello, it's me {socket.gethostname()}" in greetings
    assert (ended.code, ended.err) == (0, "")
    assert re.sub(r"(?<=robot {16})\d+ +", "N", ended.out) == (
        "MULTIMACHINE COMMUNICATION SUMMARY\n"
        "Topic: /canyouhearme, Published Msg Count: 1\n"
        "Subscribed from:\n"
        "                Hostname             Msg Count /1.0s\n"
        "                robot                N\n"
        "------------------------------------------------------------\n"
    )
    assert alone.json == {"topic": "/canyouhearme", "published": 1, "hosts": []}
