"""The memory of a decoded message stays in proportion to its bytes."""

from __future__ import annotations

import struct
from contextlib import suppress
from typing import TYPE_CHECKING, Annotated, Any, cast

import msgspec
import pytest

from actors.interfaces import cdr, types
from actors.interfaces.action_msgs.msg import GoalStatusArray
from actors.interfaces.arrays import ARRAY_BY_ELEMENT
from actors.interfaces.cdr.codec import CdrCodec
from actors.interfaces.cdr.decoder import SPARE_BYTES
from actors.interfaces.decode_budget import FACTOR
from actors.interfaces.diagnostic_msgs.msg import DiagnosticStatus
from actors.interfaces.errors import InvalidMessageError, MessageBudgetError
from actors.interfaces.fields import BINARY, fields_of
from actors.interfaces.geometry_msgs.msg import Polygon
from actors.interfaces.message import Message, type_name
from actors.interfaces.nav_msgs.msg import Path
from actors.interfaces.sensor_msgs.msg import Image, MultiEchoLaserScan
from actors.interfaces.shape_msgs.msg import Mesh
from actors.interfaces.std_msgs.msg import Empty, Float64MultiArray, UInt8MultiArray
from actors.interfaces.tf2_msgs.msg import TFMessage
from actors.interfaces.trajectory_msgs.msg import JointTrajectory
from actors.interfaces.visualization_msgs.msg import MarkerArray
from tests.actors.interfaces.test_decode_budget import bundled
from tests.allocations import peak_bytes, peak_bytes_once

if TYPE_CHECKING:
    from collections.abc import Iterator

MIB = 1024 * 1024
SPARE = MIB // 4


class Small(Message, type_name="t_msgs/msg/Small"):
    a: types.int8 = 0
    b: types.int8 = 0


class Text(Message, type_name="t_msgs/msg/Text"):
    text: str = ""
    mark: types.uint8 = 0


class Deep(Message, type_name="t_msgs/msg/Deep"):
    empties: list[Empty] = []  # noqa: RUF012
    label: str = ""


class Fixed(Message, type_name="t_msgs/msg/Fixed"):
    empties: Annotated[list[Empty], types.Length(2)] = msgspec.field(
        default_factory=lambda: [Empty(), Empty()]
    )


class Blob(Message, type_name="t_msgs/msg/Blob"):
    data: types.UInt8Sequence = b""


class Pair(Message, type_name="t_msgs/msg/Pair"):
    data: Annotated[types.UInt8Sequence, types.Length(2)] = bytes(2)


class Many(Message, type_name="t_msgs/msg/Many"):
    empties: list[Empty] = []  # noqa: RUF012
    smalls: list[Small] = []  # noqa: RUF012
    texts: list[Text] = []  # noqa: RUF012
    deep: list[Deep] = []  # noqa: RUF012
    fixed: list[Fixed] = []  # noqa: RUF012
    blobs: list[Blob] = []  # noqa: RUF012
    pairs: list[Pair] = []  # noqa: RUF012
    numbers: list[types.int8] = []  # noqa: RUF012
    flags: list[bool] = []  # noqa: RUF012
    plain: list[str] = []  # noqa: RUF012


class Tree(Message, type_name="t_msgs/msg/Tree"):
    children: list[Tree] = []  # noqa: RUF012


class Node(Message, type_name="t_msgs/msg/Node"):
    data: types.UInt8Sequence = b""
    children: list[Node] = []  # noqa: RUF012


NAMES = [field.name for field in fields_of(Many)]
NEGATIVE = b"\x80"
"""An int8 that Python has no object for."""


def many(name: str, count: int, elements: bytes) -> bytes:
    """Return a message of Many, one of whose sequences has these elements."""
    body = bytearray()
    for each in NAMES:
        body += bytes(-len(body) % 4)
        body += struct.pack("<I", count) + elements if each == name else bytes(4)
    return b"\0\1\0\0" + body


def attack(name: str, size: int) -> bytes:
    """Return a message whose elements take the most memory for about `size` bytes."""
    elements = {
        "empties": (1, b"\0"),
        "smalls": (2, NEGATIVE * 2),
        # One byte that is not UTF-8, and no NUL: the longest object for the fewest bytes.
        "texts": (8, b"\1\0\0\0\xff\0\0\0"),
        "deep": (12, b"\0\0\0\0\1\0\0\0\xff\0\0\0"),
        "fixed": (2, b"\0\0"),
        "blobs": (4, bytes(4)),
        "pairs": (2, bytes(2)),
        "numbers": (1, NEGATIVE),
        "flags": (1, b"\1"),
        "plain": (8, b"\1\0\0\0\xff\0\0\0"),
    }
    step, element = elements[name]
    return many(name, size // step, element * (size // step))


@pytest.fixture
def codec(monkeypatch: pytest.MonkeyPatch) -> CdrCodec[Many]:
    """A codec with a limit that a small message reaches, and with its decoders made."""
    monkeypatch.setattr("actors.interfaces.cdr.decoder.SPARE_BYTES", SPARE)
    made = CdrCodec(Many)
    for name in NAMES:
        made.decode(attack(name, 64))
    with pytest.raises(MessageBudgetError):
        made.decode(attack("empties", 100_000))
    return made


@pytest.mark.parametrize("name", NAMES)
def test_memory_is_in_proportion_to_the_bytes(name: str, codec: CdrCodec[Many]) -> None:
    """Decoded or refused, nothing takes more than 16 times its bytes and the limit."""
    for size in (2_000, 10_000, 80_000):
        data = attack(name, size)

        def read(data: bytes = data) -> None:
            with suppress(MessageBudgetError):
                codec.decode(data)

        assert peak_bytes_once(read) < FACTOR * len(data) + 1.1 * SPARE


@pytest.mark.parametrize("name", ["texts", "deep", "plain"])
def test_a_message_that_is_read_again_is_in_memory_once(name: str, codec: CdrCodec[Many]) -> None:
    """Its last string is the first unusual one: all of it has been made when that is found."""
    usual = {"texts": b"", "deep": bytes(4), "plain": b""}[name] + b"\3\0\0\0\xc4\x80\0\0"
    count = 80_000 // len(usual)
    whole = many(name, count, usual * count)
    data = many(name, count, usual * (count - 1) + usual.replace(b"\xc4", b"\xff"))
    assert peak_bytes_once(lambda: codec.decode(data)) < 1.2 * peak_bytes_once(lambda: codec.decode(whole))


@pytest.mark.parametrize("name", ["empties", "smalls", "fixed", "blobs", "pairs", "numbers"])
def test_too_many_small_elements_are_refused_before_they_are_made(name: str, codec: CdrCodec[Many]) -> None:
    """Each takes more than 16 times its bytes."""
    codec.decode(attack(name, 1_000))
    data = attack(name, 80_000)

    def refused() -> None:
        with pytest.raises(
            MessageBudgetError, match=r"t_msgs/msg/Many: its 80,0.* bytes would take more than"
        ):
            codec.decode(data)

    assert peak_bytes_once(refused) < FACTOR * len(data)


def test_elements_of_nested_sequences_are_charged_together(codec: CdrCodec[Many]) -> None:
    """A hundred sequences with a thousand empty messages each are a hundred thousand of them."""
    inner = struct.pack("<I", 1000) + bytes(1000) + b"\1\0\0\0\0\0\0\0"
    assert len(codec.decode(many("deep", 5, inner * 5)).deep) == 5
    with pytest.raises(MessageBudgetError):
        codec.decode(many("deep", 100, inner * 100))


def test_a_type_that_contains_itself_is_charged(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its elements are four bytes."""
    monkeypatch.setattr("actors.interfaces.cdr.decoder.SPARE_BYTES", SPARE)
    data = b"\0\1\0\0" + struct.pack("<I", 10_000) + bytes(40_000)
    with pytest.raises(MessageBudgetError):
        CdrCodec(Tree).decode(data)


def test_bytes_in_a_type_that_contains_itself_are_views_of_one(monkeypatch: pytest.MonkeyPatch) -> None:
    """They are read by a function of its own, which is called for each element."""
    monkeypatch.setattr("actors.interfaces.cdr.decoder.SPARE_BYTES", SPARE)
    codec = CdrCodec(Node)
    count = SPARE // 210  # as many as are accepted, about
    data = b"\0\1\0\0" + struct.pack("<II", 0, count) + bytes(8 * count)
    codec.decode(data)
    assert peak_bytes_once(lambda: codec.decode(data)) < FACTOR * len(data) + 1.1 * SPARE


def test_the_limit_of_all_codecs_is_16_mib() -> None:
    """A message of a million bytes may not have nothing but empty messages."""
    assert SPARE_BYTES == 16 * MIB
    with pytest.raises(MessageBudgetError, match="more than 16 times as much memory and 16 MiB"):
        cdr.decode(Many, attack("empties", 1_000_000))


@pytest.mark.parametrize(
    "cls", [TFMessage, MarkerArray, Path, Float64MultiArray, UInt8MultiArray, Many, Image]
)
@pytest.mark.parametrize("order", ["<", ">"])
def test_lengths_that_lie_cost_nothing(cls: type[Message], order: str) -> None:
    """Wherever a huge length stands, the message is refused before anything is made of it."""
    whole = cdr.encode(cls()) + bytes(60)
    head = b"\0\1" if order == "<" else b"\0\0"
    lies = [
        head + whole[2:place] + struct.pack(f"{order}I", length) + whole[place + 4 :]
        for length in (2**32 - 1, 1000)
        for place in range(4, len(whole) - 4, 4)
    ]

    def read() -> None:
        for data in lies:
            with suppress(InvalidMessageError):
                cdr.decode(cls, data)

    read()
    assert peak_bytes(read) < 64 * 1024


def full(cls: type[Message], size: int) -> Iterator[Message]:
    """Return messages of about `size` bytes, each filled by one sequence, whose elements are not empty."""
    for field in fields_of(cast("Any", cls)):
        kind = field.type
        if kind.message is not None and not kind.is_array:
            yield from (cls(**{field.name: each}) for each in full(cast("Any", kind.message), size))
        elif kind.is_array and kind.high is None:
            element = filled(kind, 1)[0]
            count = size // (len(cdr.encode(element)) if isinstance(element, Message) else 8)
            yield cls(**{field.name: filled(kind, 1) * count})


def filled(kind: Any, depth: int) -> Any:
    """Return a sequence of one element, in which sequences and strings are not empty."""
    if kind.base in BINARY:
        return b"a"
    if kind.message is None:
        items: list[Any] = (
            ["text"] if kind.base in {"string", "wstring"} else [False if kind.base == "bool" else 0]
        )
        return ARRAY_BY_ELEMENT[kind.base](items) if kind.base in ARRAY_BY_ELEMENT else items
    made = kind.message()
    for field in fields_of(kind.message):
        if field.type.is_array and not field.type.is_fixed and depth < 3:
            setattr(made, field.name, filled(field.type, depth + 1))
        elif field.type.base == "string" and not field.type.is_array:
            setattr(made, field.name, "text")
    return [made]


def test_a_large_message_of_each_bundled_type_is_accepted(pytestconfig: pytest.Config) -> None:
    """Real messages come nowhere near the limit. `make nightly` makes them as large as 2 MiB."""
    size = 2 * MIB if pytestconfig.getoption("--nightly") else MIB // 64
    checked = set[str]()
    for cls in bundled():
        for message in full(cls, size):
            data = cdr.encode(message)
            assert cdr.encode(cdr.decode(cls, data)) == data
            checked.add(type_name(cls))
    assert len(checked) > 50


@pytest.mark.parametrize(
    "cls", [GoalStatusArray, MultiEchoLaserScan, JointTrajectory, Mesh, DiagnosticStatus, Polygon]
)
def test_a_large_message_of_small_elements_is_accepted(
    cls: type[Message],
) -> None:
    """The types whose elements take the most memory for their bytes."""
    for message in full(cls, MIB):
        assert cdr.decode(cls, cdr.encode(message)) is not None


@pytest.mark.parametrize("cls", [Image, UInt8MultiArray, Float64MultiArray])
def test_large_arrays_are_copied_at_most_once(cls: Any) -> None:
    """Numbers have no object each, and bytes are a view of what was received."""
    value: Any = types.Float64Array.from_packed(bytes(MIB)) if cls is Float64MultiArray else bytes(MIB)
    message = cls(data=value)
    data = cdr.encode(message)
    assert peak_bytes(lambda: cdr.encode(message)) < 1.1 * MIB
    copies = 1 if cls is Float64MultiArray else 0
    assert peak_bytes(lambda: cdr.decode(cls, data)) < (copies + 0.1) * MIB
