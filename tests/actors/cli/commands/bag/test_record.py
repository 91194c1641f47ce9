"""`callboard bag record`: its options, and what it prints."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

import pytest
import yaml

from actors.cli.main import main
from actors.interfaces.rosbag2_interfaces.srv import IsPaused, Stop
from actors.interfaces.std_msgs.msg import String
from tests.actors.bags.recorder.recordings import messages_of
from tests.seams.limits import set_limits

if TYPE_CHECKING:
    from pathlib import Path

    from tests.actors.cli.conftest import Desk


async def test_it_records_until_it_is_stopped(desk: Desk, tmp_path: Path) -> None:
    """Names may lack their slash; the last line says how much is in the bag."""
    bag = tmp_path / "trip"
    async with desk.node() as node:
        talker = node.create_publisher(String, "/chatter", 10)
        ended = desk.start("bag", "record", "chatter", "-o", str(bag), "--custom-data", "robot=r2", "who=a=b")
        await desk.matched(talker)
        for index in range(3):
            talker.publish(String(data=str(index)))
        assert await node.create_client(Stop, "/bag_recorder/stop").call(Stop.Request()) is not None
        result = await ended
    assert result.code == 0
    assert result.out.splitlines() == [f"Recording into {bag}", f"{bag}: 3 messages of 1 topic"]
    assert [each.decoded(String).data for each in messages_of(bag)] == ["0", "1", "2"]
    metadata = yaml.safe_load((bag / "metadata.yaml").read_text(encoding="utf-8"))
    assert metadata["rosbag2_bagfile_information"]["custom_data"] == {"robot": "r2", "who": "a=b"}


async def test_options_reach_the_recorder(desk: Desk, tmp_path: Path) -> None:
    """The name of the node, pausing, and how files are written."""
    bag = str(tmp_path / "trip")
    async with desk.node() as node:
        ended = desk.start(
            *("bag", "record", "-a", "-o", bag, "--start-paused", "--node-name", "recorder"),
            *("--compression", "zstd", "--max-cache-size", "0"),
        )
        client = node.create_client(IsPaused, "/recorder/is_paused")
        await client.wait_for_service(20.0)
        assert (await client.call(IsPaused.Request())).paused
        await node.create_client(Stop, "/recorder/stop").call(Stop.Request())
        assert (await ended).code == 0


async def test_it_ends_when_no_message_arrives(desk: Desk, tmp_path: Path) -> None:
    """The exit code is 0, and the bag is complete."""
    bag = tmp_path / "trip"
    ended = await desk.callboard("bag", "record", "/a", "-o", str(bag), "--until-no-messages", "0.1")
    assert ended.code == 0
    assert (bag / "metadata.yaml").exists()


@pytest.mark.parametrize(
    ("arguments", "code", "text"),
    [
        ((), 2, "Nothing is selected"),
        (("-e", "("), 2, "not a valid regular expression"),
        (("-a", "--custom-data", "x"), 2, "expected KEY=VALUE, got 'x'"),
        (("-a", "--compression-format", "zstd"), 2, "--compression-mode"),
        (
            ("-a", "--snapshot-mode", "--max-cache-size", "0"),
            2,
            "--snapshot-mode needs memory, but --max-cache-size is 0",
        ),
        (("-a", "--use-sim-time", "--no-discovery"), 2, "--use-sim-time and --no-discovery exclude"),
        (("-a", "-b", "10"), 2, "--max-bag-size must be 0 or at least 1024 bytes"),
        (("-a", "-b", "1k"), 2, "expected a number of bytes, got '1k'"),
        (("-a", "--storage", "sqlite3"), 2, "mcap"),
        (("-a", "--qos-profile-overrides-path", "absent.yaml"), 1, "absent.yaml: No such file"),
        (("-a", "-o", "."), 1, "exists"),
    ],
)
async def test_what_cannot_be_recorded(desk: Desk, arguments: tuple[str, ...], code: int, text: str) -> None:
    """One line says what is wrong."""
    ended = await desk.callboard("bag", "record", *arguments)
    assert (ended.code, ended.out) == (code, "")
    assert text in ended.err


async def test_wrong_overrides_name_the_file(desk: Desk, tmp_path: Path) -> None:
    """And the topic, and the policy."""
    file = tmp_path / "qos.yaml"
    file.write_text("/imu: {depht: 1}")
    ended = await desk.callboard("bag", "record", "-a", "--qos-profile-overrides-path", str(file))
    assert ended.code == 1
    assert f"{file}: /imu: there is no policy 'depht'; did you mean" in ended.err


async def test_without_a_broker(
    tmp_path: Path,
    desk: Desk,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    caplog: pytest.LogCaptureFixture,
) -> None:
    """One line says so, with the exit code of all verbs; no warning precedes it, and no folder is left."""
    del desk
    set_limits(monkeypatch, connect_sec=0.2)
    code = await asyncio.to_thread(
        main, ["bag", "record", "-a", "-o", str(tmp_path / "trip"), "--url", "callboard://127.0.0.1:1"]
    )
    assert code == 3
    printed = capsys.readouterr()
    assert (printed.out, printed.err.count("\n"), caplog.text) == ("", 1, "")
    assert printed.err.startswith("No broker at callboard://127.0.0.1:1")
    assert not (tmp_path / "trip").exists()
