"""What messages may cost their reader: full ones always pass, others within the budget."""

# ruff: noqa: RUF012 - msgspec copies a default []

from __future__ import annotations

from functools import partial
from importlib import import_module
from typing import TYPE_CHECKING, Annotated, Any, TypeVar, cast

import msgpack
import msgspec
import pytest

from actors.interfaces import types
from actors.interfaces.catalog import python_package, standard_packages
from actors.interfaces.codec import codec_for, decode_untyped
from actors.interfaces.convert import message_from_fields
from actors.interfaces.decode_budget import (
    FACTOR,
    LEAST_SPARE_BYTES,
    MAX_STEPS,
    SPARE_BYTES,
    UNCHECKED_BYTES,
    Allowance,
    budget_of,
    check_untyped,
    default_bytes,
    shared_allowance,
)
from actors.interfaces.errors import InvalidMessageError, MessageBudgetError
from actors.interfaces.fields import fields_of
from actors.interfaces.geometry_msgs.msg import (
    Point,
    PoseStamped,
    PoseWithCovarianceStamped,
    Transform,
    TransformStamped,
)
from actors.interfaces.interface_names import KINDS
from actors.interfaces.message import Action, Message, Service, is_message_type, type_name
from actors.interfaces.nav_msgs.msg import Path
from actors.interfaces.sensor_msgs.msg import JointState, MultiEchoLaserScan, PointCloud2
from actors.interfaces.std_msgs.msg import Header, String
from actors.interfaces.tf2_msgs.msg import TFMessage
from actors.interfaces.visualization_msgs.msg import MarkerArray
from tests.allocations import peak_bytes_once
from tests.hostile.decode_bytes import EMPTY_MAP, starved

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

T = TypeVar("T", bound=Message)
MIB = 1024 * 1024


class Leaf(Message, type_name="t_msgs/msg/Leaf"):
    x: float = 0.0


class Tree(Message, type_name="t_msgs/msg/Tree"):
    value: int = 0
    children: list[Tree] = []


class Terse(Message, type_name="t_msgs/msg/Terse", omit_defaults=True):
    name: str = ""
    leaf: Leaf = msgspec.field(default_factory=Leaf)
    leaves: list[Leaf] = []


class Terses(Message, type_name="t_msgs/msg/Terses", omit_defaults=True):
    all: list[Terse] = []


class Track(Message, type_name="t_msgs/msg/Track", omit_defaults=True):
    predicted: list[PoseStamped] = []
    poses: list[PoseStamped] = []


class Tracks(Message, type_name="t_msgs/msg/Tracks", omit_defaults=True):
    all: list[Track] = []


class Big(Message, type_name="t_msgs/msg/Big"):
    x: Annotated[types.Int32Sequence, types.Length(1 << 24)] = msgspec.field(
        default_factory=lambda: types.Int32Array([0] * (1 << 24))
    )


class Middle(Message, type_name="t_msgs/msg/Middle"):
    leaves: Annotated[list[Leaf], types.Length(1000)] = msgspec.field(
        default_factory=lambda: [Leaf() for _ in range(1000)]
    )


class Vast(Message, type_name="t_msgs/msg/Vast"):
    middles: Annotated[list[Middle], types.Length(100_000)] = msgspec.field(
        default_factory=lambda: [Middle() for _ in range(100_000)]
    )


class Listed(Message, type_name="t_msgs/msg/Listed"):
    vast: list[Vast] = []
    note: str = ""


def bundled() -> Iterator[type[Message]]:
    """Return each message class that callboard ships, parts of services and actions included."""
    for package in standard_packages():
        for kind in KINDS:
            python = python_package(package, kind)
            module = None if python is None else import_module(python)
            for found in (getattr(module, name) for name in getattr(module, "__all__", ())):
                if is_message_type(found):
                    yield found
                elif issubclass(found, Service):
                    service: Any = cast("type[Service]", found)
                    yield from (service.Request, service.Response)
                else:
                    action: Any = cast("type[Action]", found)
                    yield from (action.Goal, action.Result, action.Feedback)


def full(cls: type[T], size: int) -> Iterator[T]:
    """Return messages of about `size` bytes with every field written, each filled by another sequence."""
    for field in fields_of(cls):
        name, kind = field.name, field.type
        nested: Any = kind.message
        if nested is None:
            continue
        if not kind.is_array:
            yield from (cls(**{name: each}) for each in full(nested, size))
        elif kind.high is None:
            # The smallest element costs the most for its bytes; and elements with elements.
            for element in (nested(), *full(nested, 200)):
                count = 1 + size // len(codec_for(nested).encode(element))
                yield cls(**{name: [element] * count})


def refused(action: Callable[[], object], match: str | None = None) -> int:
    """Return the most memory that is taken until a message is refused, with a text that matches."""

    def attempt() -> None:
        with pytest.raises(MessageBudgetError, match=match):
            action()

    return peak_bytes_once(attempt)


def test_a_full_message_of_each_bundled_type_is_accepted(pytestconfig: pytest.Config) -> None:
    """Case 62: typed and untyped. `make nightly` makes them as large as 8 MiB, and decodes them."""
    nightly = pytestconfig.getoption("--nightly")
    checked = set[str]()
    for cls in bundled():
        for message in full(cls, 8 * MIB if nightly else 2 * UNCHECKED_BYTES):
            encoded = codec_for(cls).encode(message)
            # Not even a walk is needed, which has a limit.
            assert budget_of(cls).is_proportionate(encoded), type_name(cls)
            check_untyped(encoded)
            if nightly:
                codec_for(cls).decode(encoded)
                decode_untyped(encoded)
            checked.add(type_name(cls))
    assert len(checked) > 50


@pytest.mark.parametrize("cls", [TFMessage, MarkerArray, Path, MultiEchoLaserScan])
def test_a_large_full_message_is_decoded(cls: type[Message], pytestconfig: pytest.Config) -> None:
    """Case 62: it takes whatever it takes, which is more than an allowance. `make nightly` makes 8 MiB."""
    size = 8 * MIB if pytestconfig.getoption("--nightly") else MIB
    message = next(full(cls, size))
    encoded = codec_for(cls).encode(message)
    assert len(encoded) > size
    assert codec_for(cls).decode(encoded) == message
    assert decode_untyped(encoded)


def test_a_full_point_cloud_of_8_mib_is_checked_without_a_copy() -> None:
    """Its data are skipped."""
    encoded = codec_for(PointCloud2).encode(PointCloud2(data=bytes(8 * MIB)))
    assert peak_bytes_once(lambda: budget_of(PointCloud2).is_proportionate(encoded)) < MIB


@pytest.mark.parametrize(
    ("cls", "data"),
    [
        pytest.param(TFMessage, starved("transforms", 200_000), id="elements"),
        pytest.param(Path, starved("poses", 200_000, b"\x81\xa6header\x80"), id="elements with a field"),
        pytest.param(MarkerArray, starved("markers", 200_000), id="large elements"),
        pytest.param(MarkerArray, starved("markers", 1, starved("points", 900_000)), id="nested"),
        pytest.param(Tree, starved("children", 400_000), id="a type that contains itself"),
        pytest.param(
            TFMessage,
            b"\x82" + starved("transforms", 200_000)[1:] + starved("transforms", 0)[1:],
            id="a key that is repeated",
        ),
        pytest.param(
            PoseWithCovarianceStamped,
            b"\xdf" + (100_000).to_bytes(4, "big") + b"\xa4pose\x80" * 100_000,
            id="a nested message that is repeated",
        ),
        pytest.param(Big, EMPTY_MAP, id="one field"),
        pytest.param(Listed, starved("vast", 1), id="nested fixed arrays"),
    ],
)
def test_what_is_left_out_is_charged_before_it_is_built(cls: type[Message], data: bytes) -> None:
    """Case 62: memory stays within the budget, and the error says what to do."""
    text = f"^{type_name(cls)}.*leave out fields.*write every field"
    assert refused(partial(codec_for(cls).decode, data), text) < FACTOR * len(data) + 16 * MIB


@pytest.mark.parametrize("element", [EMPTY_MAP, b"\x90", b"\xa2ab", b"\x91\x90"])
def test_numeric_sequences_hold_numbers_before_they_are_built(element: bytes) -> None:
    """Case 62: a plain array may stand for packed numbers, and have any element."""
    data = starved("position", 100_000, element)

    def attempt() -> None:
        with pytest.raises(InvalidMessageError, match=r"JointState.*float64\[\]"):
            codec_for(JointState).decode(data)

    assert peak_bytes_once(attempt) < FACTOR * len(data) + MIB


def test_a_plain_array_of_numbers_is_accepted() -> None:
    """Any sender may use one, in a message of any size."""
    numbers = [1.5, 2, True] * 40_000
    data = msgpack.packb({"position": numbers})
    assert codec_for(JointState).decode(data).position == numbers


@pytest.mark.parametrize(
    "element",
    [
        EMPTY_MAP,
        b"\x90",
        b"\x91\x90",
        b"\x81\xa0\xc0",
        b"\xc7\x00\x09",
        b"\x81\xa1a\x80",
        b"\x91" * 500 + b"\xc0",
    ],
)
def test_small_parts_of_untyped_messages_are_charged(element: bytes) -> None:
    """Case 62: maps, arrays and packed numbers, also nested."""
    data = starved("a", 500_000 // len(element), element)
    assert refused(partial(decode_untyped, data)) < FACTOR * len(data) + 16 * MIB


def test_lengths_of_untyped_messages_are_not_believed() -> None:
    """No memory is reserved for arrays that never end."""
    data = b"\x81\xa1a" + b"\xdd\x00\x7f\xff\xff" * 12_000

    def attempt() -> None:
        with pytest.raises(InvalidMessageError):
            decode_untyped(data)

    assert peak_bytes_once(attempt) < MIB


def test_untyped_numbers_and_texts_are_not_charged() -> None:
    """Messages of some types hold nothing else."""
    values = {"numbers": [1000] * 200_000, "texts": ["ab"] * 200_000, "data": bytes(MIB)}
    assert decode_untyped(msgpack.packb(values)) == values


def test_fields_that_are_left_out_have_their_defaults() -> None:
    """As long as that is in proportion, in messages of any size."""
    transform = codec_for(Transform).encode(Transform())
    element = b"\x81\xa9transform" + transform
    data = starved("transforms", 2000, element)
    assert len(data) > budget_of(TFMessage).unchecked
    assert codec_for(TFMessage).decode(data).transforms == [TransformStamped()] * 2000
    assert codec_for(TFMessage).decode(starved("transforms", 9000)).transforms == [TransformStamped()] * 9000


def test_classes_that_omit_defaults_are_decoded() -> None:
    """Only their messages leave out fields."""
    message = Terses(all=[Terse(name="a long enough name"), Terse(leaves=[Leaf(x=1.0)])] * 2000)
    encoded = codec_for(Terses).encode(message)
    assert len(encoded) > budget_of(Terses).unchecked
    assert codec_for(Terses).decode(encoded) == message
    assert codec_for(Terses).encode_decoded(message) == encoded


def test_what_readers_would_refuse_is_not_sent_either_where_it_was_decoded() -> None:
    """A message that was written in full, of a class that leaves out defaults, becomes very much smaller."""
    message = Terses(all=[Terse()] * 50_000)
    for encode in (codec_for(Terses).encode, codec_for(Terses).encode_decoded):
        with pytest.raises(MessageBudgetError):
            encode(message)


@pytest.mark.parametrize(
    "message",
    [
        pytest.param(Track(poses=[PoseStamped()] * 2000), id="sequence"),
        pytest.param(Tracks(all=[Track(poses=[PoseStamped()] * 50)] * 40), id="nested sequences"),
    ],
)
def test_full_sequences_beside_what_is_left_out_take_nothing(message: Message) -> None:
    """A large message may leave out a field here and there, as often as it is sent."""
    codec, allowance = codec_for(type(message)), Allowance()
    encoded = codec.encode(message)
    assert not budget_of(type(message)).is_proportionate(encoded)
    for _ in range(20):
        assert codec.decode(encoded, allowance) == message
    assert allowance.memory > SPARE_BYTES // 2


def test_a_sender_hears_that_readers_would_refuse_its_message() -> None:
    """A class that omits defaults can leave out too much."""
    message, codec = Terses(all=[Terse()] * 100_000), codec_for(Terses)
    with pytest.raises(MessageBudgetError, match="write every field"):
        codec.encode(message)
    with pytest.raises(MessageBudgetError, match="write every field"):
        codec.encode_behind(message, 5)


def test_a_new_message_that_no_memory_holds_is_refused() -> None:
    """It is not begun."""
    with pytest.raises(MessageBudgetError, match=r"t_msgs/msg/Vast would take [\d,]+ MiB"):
        message_from_fields(Vast, {})


def test_types_that_contain_themselves() -> None:
    """Full messages pass, at any depth that can be decoded."""
    tree = Tree(children=[Tree(value=1, children=[Tree()] * 100)] * 400)
    assert codec_for(Tree).decode(codec_for(Tree).encode(tree)) == tree


def test_unknown_fields_and_any_order() -> None:
    """Neither matters to the budget."""
    header = msgpack.packb({"frame_id": "f", "new": [b""] * 50_000, "stamp": {"nanosec": 1, "sec": 2}})
    decoded = codec_for(Header).decode(header)
    assert (decoded.frame_id, decoded.stamp.sec, decoded.stamp.nanosec) == ("f", 2, 1)


def test_a_large_message_that_is_invalid_says_why() -> None:
    """The budget does not replace the error of the field."""
    encoded = codec_for(TFMessage).encode(next(full(TFMessage, 100_000)))
    x = encoded.rindex(b"\xabtranslation") + len(b"\xabtranslation\x83\xa1x")
    nil = encoded[:x] + b"\xc0" + encoded[x + 9 :]
    with pytest.raises(InvalidMessageError, match=r"transforms\[\d+\]\.transform\.translation"):
        codec_for(TFMessage).decode(nil)
    with pytest.raises(InvalidMessageError, match="TFMessage"):
        codec_for(TFMessage).decode(encoded[:x])


@pytest.mark.parametrize("cls", [TFMessage, TransformStamped, Header, Point, Path, JointState, String])
def test_defaults_are_estimated(cls: type[Message]) -> None:
    """Within a third of what they take, and not below."""
    cls()
    kept: list[Message] = []

    def make() -> None:
        kept.extend(cls() for _ in range(1000))

    real = (peak_bytes_once(make)) / 1000
    assert 0.9 * real < default_bytes(cls) < 1.4 * real + 48


def test_defaults_are_estimated_without_making_them() -> None:
    """A fixed array of fixed arrays takes more memory than there is."""
    assert peak_bytes_once(lambda: default_bytes(Vast)) < MIB
    assert default_bytes(Vast) > 100_000 * 1000 * 40


def test_what_waits_shares_an_allowance() -> None:
    """All together have less than twice the allowance of one, and each a little."""
    shares = [shared_allowance(waiting).memory for waiting in range(100)]
    assert shares[0] == SPARE_BYTES
    assert sum(shares) < 2 * SPARE_BYTES
    assert min(shares) >= LEAST_SPARE_BYTES


def test_messages_use_up_their_allowance() -> None:
    """Small ones by what they could take, larger ones by what they do take; then only full ones pass."""
    codec, allowance = codec_for(TFMessage), Allowance()
    data = starved("transforms", 8000)
    codec.decode(data, allowance)
    assert SPARE_BYTES / 3 < allowance.memory < SPARE_BYTES * 2 / 3
    assert allowance.steps == MAX_STEPS
    codec.decode(starved("transforms", 1000, b"\x81\xaechild_frame_id\xa1a"), allowance)
    assert allowance.steps < MAX_STEPS
    with pytest.raises(MessageBudgetError):
        codec.decode(data, allowance)
    encoded = codec.encode(next(full(TFMessage, 100_000)))
    left = allowance.memory
    codec.decode(encoded, allowance)
    assert allowance.memory == left
