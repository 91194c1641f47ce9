"""Which annotations are fields."""

# ruff: noqa: RUF012 - msgspec copies a default []

from __future__ import annotations

from typing import Annotated, Any, ClassVar

import msgspec
import pytest

from actors.interfaces import types
from actors.interfaces.codec import codec_for
from actors.interfaces.fields import constants_of, fields_of
from actors.interfaces.message import Message
from actors.interfaces.sensor_msgs.msg import CameraInfo, NavSatStatus

make: Any = type(Message)
ANNOTATIONS: list[Any] = []


def test_fields_are_in_order_with_ros_types() -> None:
    """As the .msg file has them."""
    shown = [f"{field.type} {field.name}" for field in fields_of(CameraInfo)]
    assert shown[:6] == [
        "std_msgs/Header header",
        "uint32 height",
        "uint32 width",
        "string distortion_model",
        "float64[] d",
        "float64[9] k",
    ]


def test_bounds_show() -> None:
    """Bounded strings and sequences, combined."""

    class Bounded(Message):
        a: Annotated[str, types.AtMost(10)] = ""
        b: Annotated[list[Annotated[str, types.AtMost(10)]], types.AtMost(5)] = []
        c: Annotated[list[int], msgspec.Meta(min_length=2, max_length=2)] = msgspec.field(
            default_factory=lambda: [0, 0]
        )
        d: Annotated[str, msgspec.Meta(max_length=4)] = ""

    assert [str(field.type) for field in fields_of(Bounded)] == [
        "string<=10",
        "string<=10[<=5]",
        "int64[2]",
        "string<=4",
    ]


def test_constants_have_their_types() -> None:
    """Constants are class variables with a ROS type."""
    names = {name: (str(kind), value) for name, kind, value in constants_of(NavSatStatus)}
    assert names["STATUS_FIX"] == ("int8", 0)
    assert names["SERVICE_GPS"] == ("uint16", 1)


@pytest.mark.parametrize(
    "annotation",
    [
        dict[str, int],
        None,
        Any,
        object,
        list[list[int]],
        list[bytes],
        list[types.uint8],
        int | str,
        tuple[int, int],
        complex,
    ],
)
def test_a_field_without_ros_type_is_reported(annotation: Any) -> None:
    """The error names the field, the class and a remedy, where the class is defined."""
    ANNOTATIONS.append(annotation)
    for given in (annotation, "ANNOTATIONS[-1]"):
        with pytest.raises(TypeError, match=r"Field 'x' of message class Bad "):
            make("Bad", (Message,), {"__annotations__": {"x": given}, "__module__": __name__})


class Early(Message):
    """Has a field of a type that is defined later."""

    limit: ClassVar[dict[str, int]] = {}
    late: Late = 0
    same: list[Early] = msgspec.field(default_factory=list)


Late = complex


def test_a_type_that_is_defined_later_is_reported_at_the_first_use() -> None:
    """A class statement cannot tell; a constant of any type, and the class itself, are no mistake."""
    with pytest.raises(TypeError, match=r"Field 'late' of message class Early has no ROS type; use bool"):
        codec_for(Early)


def test_a_field_may_be_named_as_its_type() -> None:
    """It does not hide the type, as the annotations are read outside of the class."""
    annotations = {"names": "list[str]", "str": "str"}
    named = make("Named", (Message,), {"__annotations__": annotations, "__module__": __name__, "str": ""})
    assert [str(field.type) for field in fields_of(named)] == ["string[]", "string"]


def test_an_unknown_name_in_an_annotation_is_reported() -> None:
    """A type that cannot be found is an error with a remedy, not a NameError."""
    bad = make("Bad", (Message,), {"__annotations__": {"x": "Nowhere"}, "__module__": __name__})
    with pytest.raises(TypeError, match="top level"):
        codec_for(bad)


def test_options_that_change_the_wire_are_reported() -> None:
    """Messages are maps of field names; array_like, tag and rename would break that."""

    class Renamed(Message, rename="camel"):
        some_field: int = 0

    with pytest.raises(TypeError, match="rename"):
        codec_for(Renamed)


class Base(Message):
    a: int = 0


class Derived(Base):
    b: Annotated[types.Float64Sequence, types.Length(2)] = types.Float64Array([0, 0])


def test_inherited_fields_are_checked_too() -> None:
    """A derived class checks its base's fields, and the annotations stay as written."""
    codec = codec_for(Derived)
    assert codec.decode(codec.encode(Derived(a=1, b=[1.0, 2.0]))) == Derived(a=1, b=[1.0, 2.0])
    with pytest.raises(ValueError, match=r"Derived\.a: Expected int <="):
        codec.encode(Derived(a=2**63))
    assert Derived.__annotations__["b"].startswith("Annotated")
    assert list(Derived.__annotations__) == ["b"]
