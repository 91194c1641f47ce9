"""docs/protocol.md against the code: every generated table, diagram and byte is what the code says.

To bring the document up to date: `python tests/proto/wire/test_protocol_document.py`.
"""

from __future__ import annotations

import ast
import inspect
import re
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import msgpack
import pytest

from actors.interfaces.arrays import ARRAYS
from actors.interfaces.message import type_hash, type_name
from actors.interfaces.std_msgs.msg import String
from proto import errors, limits
from proto.queues.batches import BatchBuilder
from proto.wire import codes, frames
from proto.wire.codec import decode, encode
from proto.wire.codes import Op
from proto.wire.field_kinds import KINDS
from proto.wire.frames import SPECS, Frame
from proto.wire.session import FROM_BROKER, FROM_CLIENT, Role, Session, diagram

if TYPE_CHECKING:
    from collections.abc import Callable
    from types import ModuleType

DOCUMENT = Path(__file__).parents[3] / "docs" / "protocol.md"

KIND_TEXTS = {
    "u32": "integer from 0 to 2³² - 1",
    "u32?": "u32 or nil",
    "u32s": "array of u32",
    "u64": "integer from 0 to 2⁶⁴ - 1",
    "u64?": "u64 or nil",
    "u64s": "array of u64",
    "length": "integer from 1 to MAX_BATCH_COUNT",
    "bool": "boolean",
    "str": "text (UTF-8)",
    "str?": "str or nil",
    "bin?": "bin or nil",
    "bin16": "bin of exactly 16 bytes",
    "definition?": "bin of at most MAX_DEFINITION_BYTES, or nil",
    "map": "map from texts to scalars: text, bin, integer, float, boolean or nil",
    "attributes?": "map of at most MAX_ATTRIBUTES_BYTES in its shortest encoding, or nil",
    "requests": "array of [call: u64, remaining_ms: u32?, attributes: attributes?, body: bin]",
    "replies": "array of [call: u64, status: u32, more: false, attributes: attributes?, body: bin]",
    "graph": "array of [key: u64, kind: u32, node: str, name: str, type name: str, type hash: str, qos: map]",
    "topics": "array of the entries of §5.6.3",
    "links": "array of the entries of §5.6.4",
    "brokers": "array of the entries of §5.6.5",
}
SENDERS = {
    (True, True): "client and broker",
    (True, False): "client",
    (False, True): "broker",
}
STRING_HASH = "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"


def table(head: tuple[str, ...], rows: list[tuple[object, ...]]) -> str:
    """Return a Markdown table."""
    lines = [head, ("---",) * len(head), *rows]
    return "\n".join("| " + " | ".join(map(str, line)) + " |" for line in lines)


def documented(nodes: list[ast.stmt]) -> dict[str, str]:
    """Return the names assigned in a module or class, each with the docstring that follows it."""
    found: dict[str, str] = {}
    waiting: list[str] = []
    for node in nodes:
        if isinstance(node, ast.Assign | ast.AnnAssign):
            target = node.targets[0] if isinstance(node, ast.Assign) else node.target
            assert isinstance(target, ast.Name)
            found[target.id] = ""
            waiting.append(target.id)
        elif isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            for name in waiting:
                found[name] = inspect.cleandoc(str(node.value.value)).replace("\n", " ")
            waiting.clear()
    return found


def body_of(module: ModuleType, name: str = "") -> list[ast.stmt]:
    """Return the statements of a module, or of a class in it."""
    body = ast.parse(inspect.getsource(module)).body
    if not name:
        return body
    return next(node.body for node in body if isinstance(node, ast.ClassDef) and node.name == name)


def codes_block(module: ModuleType, name: str) -> str:
    """Return an enum's members as a table."""
    texts = documented(body_of(module, name))
    return table(
        ("code", "name", "meaning"),
        [(member.value, member.name, texts[member.name]) for member in getattr(module, name)],
    )


def frames_block() -> str:
    """Return every frame with its fields."""
    parts: list[str] = []
    for op, spec in sorted(SPECS.items()):
        cls = cast("Any", spec.frame)
        sender = SENDERS[may_send(Role.CLIENT, cls), may_send(Role.BROKER, cls)]
        rows: list[tuple[object, ...]] = [
            (f"`{name}`", f"`{kind}`{default_text(cls, name)}")
            for name, kind in zip(cls._fields, spec.kinds, strict=False)
        ]
        if spec.has_payload:
            rows.append(("`payload`", "`rest`"))
        text = inspect.cleandoc(str(cls.__doc__)).replace("\n\n", "\n").replace("\n", " ")
        text = re.sub(r" `raw` is the.*", "", text)
        parts.append(f"**{op} {Op(op).name}** ({sender}). {text}\n\n{table(('field', 'kind'), rows)}")
    return "\n\n".join(parts)


def default_text(frame: Any, name: str) -> str:
    """Describe the default of a field, if it has one."""
    defaults = frame._field_defaults
    return f"; {defaults[name]!r} if missing" if name in defaults else ""


def may_send(role: Role, frame: Any) -> bool:
    """Tell whether this role may send a frame in some state."""
    if frame in {frames.Error, frames.Goodbye}:
        return True
    if frame in {frames.Hello, frames.Welcome}:
        return (frame is frames.Hello) == (role is Role.CLIENT)
    return frame in (FROM_CLIENT if role is Role.CLIENT else FROM_BROKER)


def limits_block() -> str:
    """Return every limit with its value and reason."""
    texts = documented(body_of(limits))
    return table(
        ("limit", "value", "why"),
        [(name, f"{getattr(limits, name):,}", texts[name]) for name in texts if name.isupper()],
    )


def example() -> list[tuple[str, Frame]]:
    """Return the frames of the worked example, each with what it is."""
    qos = {"history": 1, "depth": 10, "reliability": 1, "durability": 2}
    hello: dict[str, frames.Scalar] = {
        "agent": "example", "domain": 0, "instance": b"\x11" * 16, "token": b"\x22" * 16,
    }  # fmt: skip
    welcome: dict[str, frames.Scalar] = {
        "agent": "broker", "broker": b"\x33" * 16, "session": 1, "keepalive_ms": 3000,
        "max_message_bytes": limits.MAX_MESSAGE_BYTES,
    }  # fmt: skip
    builder = BatchBuilder(0)
    builder.add(msgpack.packb({"data": "Hi"}))
    batch = builder.build(1, 1_700_000_000_000_000_000)
    return [
        ("client: HELLO", frames.Hello(limits.PROTOCOL_VERSION, hello)),
        ("broker: WELCOME", frames.Welcome(limits.PROTOCOL_VERSION, welcome)),
        ("client: NODE, id 1", frames.Node(1, "/talker")),
        ("broker: ACCEPTED, id 1", frames.Accepted(1, 0)),
        (
            "client: PUBLISHER, id 2, of node 1",
            frames.Publisher(
                2, 1, "/chatter", "std_msgs/msg/String", STRING_HASH, qos, b"\x44" * 16, 0, None, 0
            ),
        ),
        ("broker: ACCEPTED, id 2, and the broker-wide publisher id 1", frames.Accepted(2, 1)),
        ("client: BATCH of publisher 1 with one message, number 0", batch),
    ]


def example_block() -> str:
    """Return the worked example in hex."""
    parts: list[str] = []
    for index, (text, frame) in enumerate(example(), 1):
        raw = encode(frame).hex(" ")
        lines = "\n".join(raw[start : start + 96].strip() for start in range(0, len(raw), 96))
        parts.append(f"12.{index} {text}\n\n```text\n{lines}\n```")
    return "\n\n".join(parts)


CODES: dict[str, tuple[ModuleType, str]] = {
    "errors": (errors, "ErrorCode"),
    "statuses": (codes, "Status"),
    "notices": (codes, "NoticeKind"),
    "policies": (codes, "PolicyKind"),
    "reasons": (codes, "DetachReason"),
    "entries": (codes, "EntryKind"),
}
BLOCKS: dict[str, Callable[[], str]] = {
    "diagram": lambda: "\n\n".join(
        f"{'The client' if 'client' in part else 'The broker'}:\n\n```mermaid\n{part.strip()}\n```"
        for part in re.split(r"\n(?=%%)", diagram().strip())
    ),
    "kinds": lambda: table(("kind", "value"), [(f"`{kind}`", KIND_TEXTS[kind]) for kind in KINDS]),
    "frames": frames_block,
    **{name: partial(codes_block, *where) for name, where in CODES.items()},
    "elements": lambda: table(
        ("code", "element", "bytes"), [(cls.code, cls.element, cls().itemsize) for cls in ARRAYS]
    ),
    "limits": limits_block,
    "example": example_block,
}


def block_pattern(name: str) -> re.Pattern[str]:
    """Match one generated block with its markers."""
    return re.compile(f"(<!-- begin {name} -->\n)(.*?)(<!-- end {name} -->)", re.DOTALL)


def block_text(name: str) -> str:
    """Return the text between a block's markers in the document."""
    match = block_pattern(name).search(DOCUMENT.read_text(encoding="utf-8"))
    assert match, f"docs/protocol.md has no block {name}"
    return match[2].strip()


@pytest.mark.parametrize("name", BLOCKS)
def test_generated_blocks_are_up_to_date(name: str) -> None:
    """Tables, diagram, limits and example are what the code makes now (run this file to update them)."""
    assert block_text(name) == BLOCKS[name]()


def test_every_kind_is_described() -> None:
    """§8.1: the kinds of the document are the codec's."""
    assert set(KIND_TEXTS) == set(KINDS)


def test_every_limit_has_a_reason() -> None:
    """§9, §11: no limit and no code goes without a word."""
    texts = documented(body_of(limits))
    for module, name in CODES.values():
        texts |= documented(body_of(module, name))
    assert not [name for name, text in texts.items() if not text]


def test_the_example_is_a_legal_session() -> None:
    """§12: read back from the document's hex, its frames are legal in both ends' tables."""
    ends = {role: Session(role) for role in Role}
    shown = re.findall(r"```text\n(.*?)```", block_text("example"), re.DOTALL)
    assert len(shown) == len(example())
    for (text, expected), raw in zip(example(), shown, strict=True):
        frame = decode(bytes.fromhex(raw))
        assert encode(frame) == encode(expected)
        sender = Role.CLIENT if text.startswith("client") else Role.BROKER
        ends[sender].sent(frame)
        ends[Role.BROKER if sender is Role.CLIENT else Role.CLIENT].received(frame)


def test_the_example_is_what_ros_2_calls_it() -> None:
    """§10: the example's message, name and hash are the standard type's."""
    batch = cast("frames.Batch", example()[-1][1])
    assert msgpack.unpackb(bytes(batch.payload)) == [{"data": "Hi"}]
    assert type_name(String) == "std_msgs/msg/String"
    assert type_hash(String) == STRING_HASH


def paragraphs() -> list[str]:
    """Return the numbers of the document's paragraphs."""
    text = re.sub(r"```.*?```", "", DOCUMENT.read_text(encoding="utf-8"), flags=re.DOTALL)
    return re.findall(r"^(?:#+ )?(\d+(?:\.\d+)*) ", text, re.MULTILINE)


def test_paragraph_numbers_are_unique_and_rise() -> None:
    """Tests can cite paragraphs: their numbers are unique and in order."""
    keys = [tuple(map(int, number.split("."))) for number in paragraphs()]
    assert keys == sorted(set(keys))


def test_references_lead_somewhere() -> None:
    """Every § in the document, the code and these tests names a paragraph that exists."""
    text = DOCUMENT.read_text(encoding="utf-8")
    known = set(paragraphs())
    root = DOCUMENT.parents[1]
    sources = [*(root / "proto").rglob("*.py"), *(root / "tests" / "proto").rglob("*.py")]
    for source in (text, *(path.read_text(encoding="utf-8") for path in sources)):
        assert set(re.findall(r"§(\d+(?:\.\d+)*)", source)) <= known


def update() -> None:
    """Write the generated blocks into the document."""
    text = DOCUMENT.read_text(encoding="utf-8")
    for name, make in BLOCKS.items():
        text = block_pattern(name).sub(lambda match, make=make: f"{match[1]}\n{make()}\n\n{match[3]}", text)  # type: ignore[misc]
    DOCUMENT.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    update()
