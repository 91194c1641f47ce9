"""`callboard bag`: the verbs that read and write bags without a broker."""

from __future__ import annotations

import csv
import json
from typing import TYPE_CHECKING

import pytest

from actors.bags import BagTopic, Reader, Writer
from actors.cli.main import main
from actors.interfaces import cdr
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.geometry_msgs.msg import PoseStamped
from actors.interfaces.sensor_msgs.msg import CompressedImage
from actors.interfaces.std_msgs.msg import String
from proto.extras import install_command
from tests.actors.bags.bags import CHATTER, START_NS, text, write_bag

if TYPE_CHECKING:
    from pathlib import Path

FORMAT = "Serialization Format: cdr"
SERVICE = "example_interfaces/srv/AddTwoInts"
Capsys = pytest.CaptureFixture[str]


@pytest.fixture(autouse=True)
def _own_folder(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)


def test_info_prints_what_ros_prints(tmp_path: Path, capsys: Capsys) -> None:
    """It prints files, size, times, topics with types and counts, services separately, and losses."""
    with Writer("trip") as bag:
        chatter = bag.add_topic(CHATTER)
        events = bag.add_topic(BagTopic.of_class("/add/_service_event", AddTwoInts.Event))
        bag.write(chatter, text("a"), START_NS, START_NS)
        bag.write(events, cdr.encode(AddTwoInts.Event()), START_NS + 1_500_000_000, START_NS)
        bag.set_losses({"/chatter": 3})
    assert main(["bag", "info", "trip"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "Files:             trip_0.mcap"
    assert "Duration:          1.500000000s" in lines
    assert lines[5].startswith("Start:             Nov 1")
    assert lines[5].endswith(" (1700000000.000000000)")
    assert lines[7:] == [
        "Messages:          1",
        f"Topic information: Topic: /chatter | Type: std_msgs/msg/String | Count: 1 | {FORMAT}",
        "Services:          1",
        f"Service information: Service: /add | Type: {SERVICE} | Event Count: 1 | {FORMAT}",
        "Dropped:           Topic: /chatter | Count: 3",
    ]


def test_info_as_json_names_and_sizes(tmp_path: Path, capsys: Capsys) -> None:
    """`--json` prints all values, `-t` only names, and `-v` adds the bytes of each topic."""
    write_bag(tmp_path / "trip")
    assert main(["bag", "info", "trip", "--json", "-v"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert (document["message_count"], document["start_ns"], document["duration_ns"]) == (20, START_NS, 19)
    sizes = {each["name"]: each["size"] for each in document["topics"]}
    assert sizes["/count"] == 80
    assert main(["bag", "info", "trip", "-t"]) == 0
    assert capsys.readouterr().out == "/chatter\n/count\n"


def test_echo_prints_as_topic_echo_does(tmp_path: Path, capsys: Capsys) -> None:
    """It prints one topic, a field, from an offset, or once; an unknown topic is an error."""
    write_bag(tmp_path / "trip", 6)
    assert main(["bag", "echo", "trip", "/count"]) == 0
    assert capsys.readouterr().out == "data: 0\n---\ndata: 2\n---\ndata: 4\n---\n"
    assert main(["bag", "echo", "trip", "/count", "--field", "data", "--filter", "m.data > 0", "--json"]) == 0
    assert capsys.readouterr().out == "2\n4\n"
    assert main(["bag", "echo", "trip", "/chatter", "--once", "--start-offset", "0.000000002", "--csv"]) == 0
    assert capsys.readouterr().out == "text 2\n"
    assert main(["bag", "echo", "trip", "/chater"]) == 1
    assert capsys.readouterr().err == "trip has no topic '/chater'; did you mean '/chatter'?\n"


def test_check_finds_what_is_wrong(tmp_path: Path, capsys: Capsys) -> None:
    """A whole bag passes; wrong bytes, a wrong hash, wrong counts and a missing end are reported."""
    path = write_bag(tmp_path / "trip")
    assert main(["bag", "check", "trip"]) == 0
    assert capsys.readouterr().out == "20 messages of 2 topics can be decoded, 0 cannot\n"
    metadata = (tmp_path / "trip" / "metadata.yaml").read_text(encoding="utf-8")
    changed = metadata.replace("message_count: 10", "message_count: 11", 1)
    (tmp_path / "trip" / "metadata.yaml").write_text(changed, encoding="utf-8")
    assert main(["bag", "check", "trip", "--json"]) == 1
    assert json.loads(capsys.readouterr().out)["problems"] == [
        "/chatter: metadata.yaml states 11 messages, but the files have 10"
    ]
    path.write_bytes(path.read_bytes()[:1500])
    assert main(["bag", "check", "trip/trip_0.mcap"]) == 1
    assert "its end is missing" in capsys.readouterr().out
    with Writer("wrong") as bag:
        number = bag.add_topic(BagTopic("/a", "std_msgs/msg/String", "string data\n", type_hash="RIHS01_0"))
        other = bag.add_topic(CHATTER)
        bag.write(number, text("a"), START_NS, START_NS)
        bag.write(other, b"\0\1\0\0\xff\0\0\0", START_NS, START_NS)
    assert main(["bag", "check", "wrong"]) == 1
    out = capsys.readouterr().out
    assert "/a: its type hash RIHS01_0 differs from that of its definition" in out
    assert "/chatter, time 1700000000000000000: std_msgs/msg/String" in out


def test_check_of_a_path_without_a_bag(capsys: Capsys) -> None:
    """One sentence on stderr says that there is none, also as JSON."""
    for options in ([], ["--json"]):
        assert main(["bag", "check", "absent", *options]) == 1
        assert capsys.readouterr() == ("", "There is no file absent\n")


def test_check_reports_a_missing_file_of_a_bag(tmp_path: Path, capsys: Capsys) -> None:
    """The bag is there, so it is one of its problems."""
    write_bag(tmp_path / "trip").unlink()
    assert main(["bag", "check", "trip"]) == 1
    assert capsys.readouterr().out.startswith("There is no file trip/trip_0.mcap\n")


def test_reindex_writes_the_metadata_of_a_killed_recorder(tmp_path: Path, capsys: Capsys) -> None:
    """It writes a missing or damaged metadata.yaml from the files."""
    path = write_bag(tmp_path / "trip")
    path.write_bytes(path.read_bytes()[:1800])
    (tmp_path / "trip" / "metadata.yaml").unlink()
    for _ in range(2):
        assert main(["bag", "reindex", "trip"]) == 0
        captured = capsys.readouterr()
        assert "trip/metadata.yaml: 1 file, 2 topics, " in captured.out
        assert "its end is missing" in captured.err
        (tmp_path / "trip" / "metadata.yaml").write_text("{", encoding="utf-8")
    assert main(["bag", "reindex", "trip"]) == 0
    with Reader("trip") as bag:
        assert 0 < bag.summary().message_count == len(list(bag.messages())) < 20


def test_recover_keeps_what_is_whole(tmp_path: Path, capsys: Capsys) -> None:
    """A damaged chunk is left out, and those behind it are copied; the report counts by topic."""
    path = write_bag(tmp_path / "trip", 40)
    data = bytearray(path.read_bytes())
    data[data.index(b"text 8")] ^= 1
    path.write_bytes(data)
    assert main(["bag", "recover", "trip", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["output"] == "trip_recovered"
    [damage] = document["damages"]
    assert "trip_0.mcap: byte " in damage
    with Reader("trip_recovered") as bag:
        times = [message.log_time_ns - START_NS for message in bag.messages()]
    assert sum(document["kept"].values()) == len(times)
    lost = set(range(40)) - set(times)
    assert 8 in lost
    assert max(lost) < 39
    assert times == sorted(set(range(40)) - lost)
    assert main(["bag", "check", "trip_recovered"]) == 0
    capsys.readouterr()
    assert main(["bag", "recover", "trip"]) == 1
    assert capsys.readouterr().err == "trip_recovered exists; choose another path, or remove it\n"


def test_recover_without_any_message_fails(tmp_path: Path, capsys: Capsys) -> None:
    """A script sees it by the exit code, and a person by the sentence."""
    path = write_bag(tmp_path / "trip")
    path.write_bytes(path.read_bytes()[:300])
    assert main(["bag", "recover", "trip"]) == 1
    captured = capsys.readouterr()
    assert captured.out == ""
    assert (
        captured.err.splitlines()[-1]
        == "No message of trip could be read; trip_recovered has only its topics"
    )
    assert main(["bag", "recover", "trip", "-o", "other", "--json"]) == 1
    assert json.loads(capsys.readouterr().out)["kept"] == {}


def test_recover_at_each_cut(tmp_path: Path) -> None:
    """Truncated anywhere, a file gives a bag with its whole chunks, or is refused as not an MCAP file."""
    path = write_bag(tmp_path / "trip")
    whole = path.read_bytes()
    counts = list[int]()
    for end in range(0, len(whole), 101):
        cut = tmp_path / f"cut{end}.mcap"
        cut.write_bytes(whole[:end])
        main(["bag", "recover", str(cut)])
        if (tmp_path / f"cut{end}_recovered").exists():
            with Reader(tmp_path / f"cut{end}_recovered") as bag:
                times = [message.log_time_ns - START_NS for message in bag.messages()]
            assert times == list(range(len(times)))
            counts.append(len(times))
    assert counts == sorted(counts)
    assert counts[-1] == 20


def test_convert_joins_filters_and_compresses(tmp_path: Path, capsys: Capsys) -> None:
    """Several bags are joined by time, with selected topics, in files of a limited size."""
    write_bag(tmp_path / "a", 4)
    write_bag(tmp_path / "b", 4)
    assert main(["bag", "convert", "a", "-i", "b", "mcap", "-o", "c", "--compression", "zstd"]) == 0
    assert capsys.readouterr().out == "c: 8 messages of 2 topics\n"
    with Reader("c") as bag:
        assert [message.log_time_ns - START_NS for message in bag.messages()] == [0, 0, 1, 1, 2, 2, 3, 3]
    assert main(["bag", "convert", "c", "-o", "d", "--topics", "/count"]) == 0
    assert capsys.readouterr().out == "d: 4 messages of 1 topic\n"
    assert main(["bag", "convert", "-o", "e"]) == 2
    assert main(["bag", "convert", "a", "-o", "e", "-b", "7"]) == 2
    assert "at least 1024 bytes" in capsys.readouterr().err


def test_export_writes_a_table_for_each_topic(tmp_path: Path, capsys: Capsys) -> None:
    """Tables have one column per field, also of nested messages; sequences are JSON, bytes base64."""
    with Writer("trip") as bag:
        pose = bag.add_topic(BagTopic.of_class("/arm/pose", PoseStamped))
        image = bag.add_topic(BagTopic.of_class("/image", CompressedImage))
        odd = bag.add_topic(BagTopic.of_class("/../../odd name", String))
        bag.write(pose, cdr.encode(PoseStamped()), START_NS, START_NS - 1, 7)
        bag.write(image, cdr.encode(CompressedImage(format="png", data=b"\1\2\3")), START_NS, START_NS)
        bag.write(odd, text('a,"b"\nc'), START_NS, START_NS)
    assert main(["bag", "export", "trip", "--csv"]) == 0
    assert "trip_csv/arm.pose.csv: 1 message of /arm/pose\n" in capsys.readouterr().out
    [head, row] = csv.reader(
        (tmp_path / "trip_csv" / "arm.pose.csv").read_text(encoding="utf-8").splitlines()
    )
    assert head[:3] == ["log_time_ns", "publish_time_ns", "sequence"]
    assert dict(zip(head, row, strict=True))["pose.orientation.w"] == "1.0"
    assert row[:3] == [str(START_NS), str(START_NS - 1), "7"]
    text_of = (tmp_path / "trip_csv" / "image.csv").read_text(encoding="utf-8")
    assert text_of.splitlines()[1].endswith(",png,AQID")
    names = sorted(path.name for path in (tmp_path / "trip_csv").iterdir())
    assert names == ["arm.pose.csv", "image.csv", "odd%20name.csv"]


def test_list_names_formats(capsys: Capsys) -> None:
    """It lists formats, and with -v what each is for."""
    assert main(["bag", "list", "storage"]) == 0
    assert capsys.readouterr().out == "mcap\nsqlite3\n"
    assert main(["bag", "list", "compressor", "-v"]) == 0
    assert "zstd: for the chunks of files" in capsys.readouterr().out


def test_errors_are_one_sentence(tmp_path: Path, capsys: Capsys) -> None:
    """Anything but a bag gives one line on stderr and exit code 1."""
    (tmp_path / "file").write_bytes(b"no bag")
    for path in ("nothing", "file", "."):
        assert main(["bag", "info", path]) == 1
        captured = capsys.readouterr()
        assert captured.out == ""
        assert captured.err.count("\n") == 1


def test_without_the_extra_one_sentence_says_so(monkeypatch: pytest.MonkeyPatch, capsys: Capsys) -> None:
    """If a library is missing, the error names the extra."""
    monkeypatch.setattr("actors.bags.extra.find_spec", lambda name: None)
    assert main(["bag", "info", "trip"]) == 1
    assert capsys.readouterr().err == f"Bags need more packages: {install_command('bags')}\n"
