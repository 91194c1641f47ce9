"""Labels of nodes: information for users and tools, such as `origin: ros2/7` (docs/protocol.md §5.2.4).

They travel in NODE as a map, and in the graph as keys `label.NAME` of the node's qos map. Endpoints of a node
with labels name its entry there, as nodes may share names.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any, Final

from proto import limits
from proto.wire.codes import EntryKind

if TYPE_CHECKING:
    from collections.abc import Mapping

    from proto.wire.frames import GraphEntry, Options

NODE_KEY: Final = "node"
"""In the qos map of an endpoint whose node has labels: the key of the node's entry."""

_PREFIX: Final = "label."
_NAME: Final = re.compile(rf"[A-Za-z0-9_./-]{{1,{limits.MAX_LABEL_NAME}}}")


def check_labels(labels: Mapping[str, Any]) -> None:
    """Check the labels of a node.

    Raises:
        ValueError: There are too many, one is too long, or a text is not a label's; it says what is allowed.
    """
    if len(labels) > limits.MAX_LABELS:
        raise ValueError(f"a node has at most {limits.MAX_LABELS} labels, not {len(labels)}")
    size = 0
    for name, value in labels.items():
        if not _NAME.fullmatch(name):
            most = limits.MAX_LABEL_NAME
            raise ValueError(f"a label's name is 1 to {most} letters, digits and _./-, not {name!r:.80}")
        check_label_text(f"the value of the label '{name}'", value)
        size += len(name) + len(value.encode())
    if size > limits.MAX_LABELS_BYTES:
        raise ValueError(f"a node's labels have at most {limits.MAX_LABELS_BYTES} bytes, not {size}")


def check_label_text(what: str, text: Any) -> None:
    """Check the value of a label, or another text with the same limits.

    Args:
        what: The text's name in the error.
        text: Anything.

    Raises:
        ValueError: It is not printable text of at most 256 bytes.
    """
    most = limits.MAX_LABEL_BYTES
    if not (isinstance(text, str) and text.isprintable() and len(text.encode()) <= most):
        raise ValueError(f"{what} is printable text of at most {most} bytes, not {text!r:.80}")


def labels_to_qos(labels: Options) -> dict[str, Any]:
    """Return what the qos map of a node's entry has for its labels."""
    return {_PREFIX + name: value for name, value in labels.items()}


def labels_of(entry: GraphEntry) -> dict[str, str]:
    """Return the labels in a node's entry; none in another entry."""
    if entry.kind != EntryKind.NODE or not entry.qos:
        return {}
    return {
        key.removeprefix(_PREFIX): value
        for key, value in entry.qos.items()
        if key.startswith(_PREFIX) and isinstance(value, str)
    }
