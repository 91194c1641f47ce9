"""Labels of nodes: what NODE and GRAPH say of them, to peers of every age, and what is refused."""

from __future__ import annotations

import msgpack
import pytest

from proto import limits
from proto.wire import frames
from proto.wire.codec import decode, encode
from proto.wire.codes import EntryKind, Op
from proto.wire.labels import check_label_text, check_labels, labels_of, labels_to_qos


def framed(*header: object) -> bytes:
    """Return a frame with this header."""
    content = msgpack.packb(header)
    return b"\xc6" + len(content).to_bytes(4, "big") + content


def test_a_node_of_an_earlier_client_has_no_labels() -> None:
    """A NODE that ends before them has the defaults; one with them comes back as it was."""
    assert decode(framed(Op.NODE, 1, "/a")) == frames.Node(1, "/a")
    node = frames.Node(1, "/a", shared=True, labels={"origin": "ros2/7"}, apart="ros2/7")
    assert decode(encode(node)) == node
    yielding = node._replace(yields=True)
    assert decode(encode(yielding)) == yielding
    assert encode(node) == framed(Op.NODE, 1, "/a", True, {"origin": "ros2/7"}, "ros2/7", False)


def test_labels_are_read_from_the_entries_of_nodes_only() -> None:
    """Beside `shared`, and never from an endpoint, whose qos map may have any key; a value is a text."""
    qos = {"shared": True, **labels_to_qos({"origin": "ros2/7", "a.b": "c"}), "label.x": 7}
    entry = frames.GraphEntry(1, EntryKind.NODE, "/a", "", "", "", qos)
    assert labels_of(entry) == {"origin": "ros2/7", "a.b": "c"}
    assert labels_of(entry._replace(kind=EntryKind.PUBLISHER)) == {}
    assert labels_of(entry._replace(qos={})) == {}


@pytest.mark.parametrize(
    ("labels", "reason"),
    [
        ({str(number): "" for number in range(limits.MAX_LABELS + 1)}, "at most 16 labels, not 17"),
        ({"": "x"}, "1 to 64 letters, digits and _./-, not ''"),
        ({"a b": "x"}, "not 'a b'"),
        ({"a" * 65: "x"}, "1 to 64 letters"),
        ({"a": "x" * 257}, "'a' is printable text of at most 256 bytes"),
        ({"a": "é" * 129}, "at most 256 bytes"),
        ({"a": "x\ny"}, r"printable text of at most 256 bytes, not 'x\\ny'"),
        ({"a": "\ud800"}, "printable text"),
        ({"a": 7}, "printable text of at most 256 bytes, not 7"),
        ({str(number): "x" * 255 for number in range(5)}, "at most 1024 bytes, not 1280"),
    ],
)
def test_labels_beyond_a_limit_are_refused(labels: dict[str, object], reason: str) -> None:
    """The error names the limit and shows what is wrong."""
    with pytest.raises(ValueError, match=reason):
        check_labels(labels)


def test_labels_up_to_the_limits_are_allowed() -> None:
    """Every limit is inclusive, and letters of any language may be in a value."""
    check_labels({"a" * 64: "x" * 256, "B.c/d-e_9": "é ü", **{str(number): "" for number in range(14)}})
    check_labels({"a": "x" * 255, "b": "x" * 255, "c": "x" * 255, "d": "x" * 255})
    check_label_text("apart", "é" * 128)
