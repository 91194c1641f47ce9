"""Write the byte-level cases (`bytes/*.json`): what a client may send, and what must come back.

    python -m tests.hostile.generate

The files are for brokers in any language; README.md says how to read them. The cases of frames and their
fields follow from the grammar (`proto.wire.frames.SPECS`): a new frame or field has its cases at once.
"""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import msgpack

from proto import limits
from proto.wire import frames
from proto.wire.codec import array_head, encode
from proto.wire.codes import Op
from proto.wire.frames import SPECS
from proto.wire.session import FROM_BROKER, FROM_CLIENT
from tests.broker import frame_makers as make

if TYPE_CHECKING:
    from collections.abc import Iterator

DIRECTORY: Final = Path(__file__).parent / "bytes"

PUBLISHER: Final = 0xFEEDFACECAFEBEEF
"""Takes the place of the number that the broker has given to publisher 1."""
PLACEHOLDER: Final = "<publisher>"

IDENTITY: Final[dict[str, frames.Scalar]] = {"instance": b"i" * 16, "token": b"t" * 16}
HELLO: Final = encode(frames.Hello(limits.PROTOCOL_VERSION, IDENTITY))
DECLARED: Final[tuple[frames.Frame, ...]] = (
    frames.Node(0, "/n"),
    make.publisher(1),
    make.subscription(2),
    make.service(3),
    make.client(4, "/other"),
)
DECLARATIONS: Final = b"".join(encode(declared) for declared in DECLARED)
STATES: Final = {"start": [], "open": [HELLO], "declared": [HELLO, DECLARATIONS]}


class Case(NamedTuple):
    """One attack. `cases`: its numbers in README.md."""

    name: str
    cases: tuple[int, ...]
    state: str
    send: bytes
    expect: str


def framed(content: bytes) -> bytes:
    """Put content into a frame."""
    return b"\xc6" + len(content).to_bytes(4, "big") + content


def frame(op: int, fields: list[Any], payload: bytes = b"") -> bytes:
    """Return a frame with any fields."""
    return framed(msgpack.packb([int(op), *fields]) + payload)


# Fields

VALUES: Final[dict[str, Any]] = {
    "nil": None,
    "a bool": True,
    "an integer": 1,
    "a float": 0.5,
    "a text": "\x1b[2J",
    "bytes": b"x",
    "an array": [[]],
    "a map": {"x": 1},
}
"""One value of each type; no field takes this array."""

TYPES: Final[dict[str, set[str]]] = {
    "u32": {"an integer"},
    "u32?": {"an integer", "nil"},
    "u32s": set(),
    "u64": {"an integer"},
    "u64?": {"an integer", "nil"},
    "u64s": set(),
    "length": {"an integer"},
    "bool": {"a bool"},
    "str": {"a text"},
    "str?": {"a text", "nil"},
    "bin?": {"bytes", "nil"},
    "bin16": set(),
    "definition?": {"bytes", "nil"},
    "map": {"a map"},
    "attributes?": {"a map", "nil"},
    "requests": set(),
    "replies": set(),
}
"""Which of them a kind of field takes."""

LARGE_LIST: Final = [1] * (limits.MAX_HEADER_ARRAY + 1)
BAD_MAPS: Final[dict[str, Any]] = {
    "too many entries": {f"{n:02}": 1 for n in range(limits.MAX_HEADER_MAP + 1)},
    "an integer as key": {1: 1},
    "a nested value": {"x": [1]},
    "an extension value": {"x": msgpack.ExtType(5, b"x")},
}
BAD_TEXT: Final[dict[str, Any]] = {"too long": "x" * (limits.MAX_HEADER_STRING_BYTES + 1)}
REQUEST: Final = [1, None, None, b"q"]
REPLY: Final = [1, 0, False, None, b"a"]

RANGES: Final[dict[str, dict[str, Any]]] = {
    "u32": {"-1": -1, "2^32": 2**32},
    "u32?": {"-1": -1, "2^32": 2**32},
    "u32s": {"an element of -1": [-1], "an element of 2^32": [2**32], "too long": LARGE_LIST},
    "u64": {"-1": -1},
    "u64?": {"-1": -1},
    "u64s": {"an element of -1": [-1], "an element of nil": [None], "too long": LARGE_LIST},
    "length": {"-1": -1, "0": 0, "too large": limits.MAX_BATCH_COUNT + 1},
    "bool": {},
    "str": BAD_TEXT,
    "str?": BAD_TEXT,
    "bin?": {},
    "bin16": {"15 bytes": bytes(15), "17 bytes": bytes(17)},
    "definition?": {"too long": bytes(limits.MAX_DEFINITION_BYTES + 1)},
    "map": BAD_MAPS,
    "attributes?": BAD_MAPS | {"too long": {"x": bytes(limits.MAX_ATTRIBUTES_BYTES)}},
    "requests": {
        "an entry of 3 fields": [REQUEST[:3]],
        "a call of -1": [[-1, *REQUEST[1:]]],
        "a time of 2^32": [[1, 2**32, None, b"q"]],
        "nested attributes": [[1, None, {"x": [1]}, b"q"]],
        "attributes that are too long": [[1, None, {"x": bytes(limits.MAX_ATTRIBUTES_BYTES)}, b"q"]],
        "a text as body": [[1, None, None, "q"]],
        "too long": [REQUEST] * (limits.MAX_HEADER_ARRAY + 1),
    },
    "replies": {
        "an entry of 4 fields": [REPLY[:4]],
        "a call of nil": [[None, *REPLY[1:]]],
        "a status of -1": [[1, -1, *REPLY[2:]]],
        "more": [[1, 0, True, None, b"a"]],
        "nil as body": [[*REPLY[:4], None]],
        "too long": [REPLY] * (limits.MAX_HEADER_ARRAY + 1),
    },
}
"""Values of the right type that a kind of field does not take."""

PLAIN: Final[dict[str, Any]] = {
    "u32s": [],
    "u64s": [],
    "length": 1,
    "bool": False,
    "str": "/new",
    "bin16": bytes(16),
    "map": {},
    "requests": [],
    "replies": [],
    "graph": [],
    "topics": [],
    "links": [],
    "brokers": [],
}
"""Valid values; integers depend on their place, and what may be nil is nil."""

EXAMPLES: Final[dict[int, list[Any]]] = {
    Op.HELLO: [limits.PROTOCOL_VERSION, IDENTITY],
    Op.FRAGMENT: [90, 100, True],
    Op.REFERENCE: [PUBLISHER, 0, 1, 1, None, None, 1, 4096, 64, 65_536, 1],
}
"""Where those are not."""

PAYLOADS: Final = {Op.BATCH: array_head(1) + b"\x01", Op.REPLAY: array_head(1) + b"\x01", Op.FRAGMENT: b"x"}


def plain_fields(op: int) -> list[Any]:
    """Return valid fields: an unused id, node 0, or the publisher's number."""
    if op in EXAMPLES:
        return list(EXAMPLES[op])
    first = {"u32": 90, "u64": PUBLISHER}
    kinds = SPECS[op].kinds
    return [
        (first if not n else {}).get(kind, None if kind.endswith("?") else PLAIN.get(kind, 0))
        for n, kind in enumerate(kinds)
    ]


def field_cases() -> Iterator[Case]:
    """Each field of each frame of a client: missing, of another type, out of range, and one too many."""
    ends = {Op.ERROR: "closed", Op.GOODBYE: "closed"}
    shared_memory = (Op.ARENA, Op.MAPPED, Op.REFERENCE, Op.RELEASE, Op.PROOF)
    ends |= dict.fromkeys(shared_memory, "ERROR UNEXPECTED")  # the client is on no host
    for op, spec in SPECS.items():
        if spec.frame not in FROM_CLIENT | {frames.Hello, frames.Error, frames.Goodbye}:
            continue
        state = "start" if op == Op.HELLO else "declared"
        plain, payload, name = plain_fields(op), PAYLOADS.get(Op(op), b""), Op(op).name
        required = len(plain) - len(spec.frame._field_defaults)  # type: ignore[attr-defined]
        fine = "welcome" if op == Op.HELLO else ends.get(Op(op), "open")
        yield Case(f"{name}: a field too many", (16,), state, frame(op, [*plain, "extra"], payload), fine)
        for place, kind in enumerate(spec.kinds):
            expect = "ERROR MALFORMED" if place < required else fine
            missing = frame(op, plain[:place], payload)
            yield Case(f"{name}: no field {place + 1}", (14, 16), state, missing, expect)
            wrong = {label: VALUES[label] for label in VALUES if label not in TYPES[kind]}
            for label, value in (wrong | RANGES[kind]).items():
                if op == Op.HELLO and len(msgpack.packb(value)) > 1000:
                    continue  # the frame is too large
                fields = [*plain[:place], value, *plain[place + 1 :]]
                title = f"{name}: field {place + 1} is {kind}, not {label}"
                yield Case(title, (16,), state, frame(op, fields, payload), "ERROR MALFORMED")


def order_cases() -> Iterator[Case]:
    """Frames that a state of the session, or the direction, does not allow, and unknown opcodes."""
    for op, spec in SPECS.items():
        raw, name = frame(op, plain_fields(op), PAYLOADS.get(Op(op), b"")), Op(op).name
        if spec.frame not in {frames.Hello, frames.Error}:
            yield Case(f"{name} before HELLO", (7, 17), "start", raw, "ERROR UNEXPECTED")
        if spec.frame in FROM_BROKER - FROM_CLIENT | {frames.Welcome}:
            yield Case(f"{name} from a client", (17,), "open", raw, "ERROR UNEXPECTED")
    yield Case("ERROR before HELLO", (7,), "start", encode(frames.Error(1, "x")), "closed")
    yield Case("HELLO twice", (7,), "open", HELLO, "ERROR UNEXPECTED")
    for op in sorted(set(range(128)) - set(SPECS)):
        yield Case(f"opcode {op}", (17,), "open", frame(op, [1]), "ERROR MALFORMED")
    yield Case("a negative opcode", (17,), "open", framed(b"\x92\xff\x01"), "ERROR MALFORMED")
    yield Case("an opcode of two bytes", (17,), "open", framed(b"\x92\xcc\x05\x01"), "ERROR MALFORMED")


def bytes_cases() -> Iterator[Case]:
    """Other protocols, impossible sizes, and what is not msgpack, before and after the handshake."""
    everywhere: dict[str, tuple[tuple[int, ...], bytes, str]] = {
        "HTTP": ((6,), b"GET / HTTP/1.1\r\nHost: x\r\n\r\n", "MALFORMED"),
        "TLS": ((6,), b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03", "MALFORMED"),
        "SSH": ((6,), b"SSH-2.0-OpenSSH_9.6\r\n", "MALFORMED"),
        "a size of 4 GiB": ((3, 4), b"\xc6\xff\xff\xff\xff", "TOO_LARGE"),
        "a size beyond the limit": (
            (4,),
            b"\xc6" + (limits.MAX_FRAME_BYTES + 1).to_bytes(4, "big"),
            "TOO_LARGE",
        ),
        "an empty frame": ((4,), framed(b""), "MALFORMED"),
        "a frame of one byte": ((4,), framed(b"\x91"), "MALFORMED"),
        "another msgpack form": ((4,), b"\xc4\x03\x92\x05\x01", "MALFORMED"),
        "a header that ends early": ((14,), framed(b"\x92\x05"), "MALFORMED"),
        "a header that is a map": ((16,), framed(b"\x81\x05\x01"), "MALFORMED"),
        "a header without elements": ((16,), framed(b"\x90\x05"), "MALFORMED"),
        "an array of 2^32 items": ((10,), framed(b"\x93\x01\x01\xdd\xff\xff\xff\xff"), "MALFORMED"),
        "a map of 2^32 items": ((10,), framed(b"\x93\x01\x01\xdf\xff\xff\xff\xff"), "MALFORMED"),
        "a text of 2^32 bytes": ((10,), framed(b"\x93\x01\x01\xdb\xff\xff\xff\xff"), "MALFORMED"),
        "nested 3,000 deep": ((11,), framed(b"\x93\x01\x01" + b"\x91" * 3000), "MALFORMED"),
        "nested claims": ((50,), framed(b"\x93\x01\x01" + b"\xdc\x20\x00" * 1000), "MALFORMED"),
        "an extension type": ((12,), framed(b"\x93\x01\x01\xd4\x05\x00"), "MALFORMED"),
        "a timestamp of impossible size": ((12,), framed(b"\x93\x01\x01\xc7\x05\xff12345"), "MALFORMED"),
        "an impossible timestamp": ((12,), framed(b"\x93\x01\x01\xd7\xff" + b"\xff" * 8), "MALFORMED"),
        "a reserved byte": ((12,), framed(b"\x93\x01\x01\xc1"), "MALFORMED"),
        "a key of invalid UTF-8": ((13,), framed(b"\x93\x01\x01\x81\xa2\xff\xfe\x01"), "MALFORMED"),
        "a map as key": ((13,), framed(b"\x93\x01\x01\x81\x80\x01"), "MALFORMED"),
        "an array as key": ((13,), framed(b"\x93\x01\x01\x81\x91\x01\x01"), "MALFORMED"),
        "NaN as key": ((13,), framed(b"\x93\x01\x01\x81\xcb\x7f\xf8" + bytes(6) + b"\x01"), "MALFORMED"),
        "bytes behind the header": ((14,), framed(b"\x92\x05\x01trailing"), "MALFORMED"),
    }
    for name, (cases, data, code) in everywhere.items():
        for state in ("start", "open"):
            yield Case(f"{name}, {state}", cases, state, data, f"ERROR {code}")
    yield from _hello_cases()
    node = framed(b"\x93\x0a\x5a\xa3/\xff\xfe")
    yield Case("a name of invalid UTF-8", (13,), "open", node, "ERROR MALFORMED")
    deep = frame(Op.REQUEST, [4])[:-1] + b"\x04" + b"\x91" * 50_000
    yield Case("nested 50,000 deep", (11,), "declared", framed(deep[5:]), "ERROR MALFORMED")
    twice = framed(b"\x93\x01\x01\x84" + msgpack.packb(IDENTITY)[1:] + b"\xa1x\x01\xa1x\x02")
    yield Case("a key twice", (13,), "start", twice, "welcome")


def _hello_cases() -> Iterator[Case]:
    def hello(**options: frames.Scalar) -> bytes:
        return encode(frames.Hello(limits.PROTOCOL_VERSION, IDENTITY | options))

    for name, cases, raw, code in (
        ("another version", (7,), encode(frames.Hello(99, IDENTITY)), "VERSION"),
        ("no identity", (24,), encode(frames.Hello(1, {})), "MALFORMED"),
        ("a short instance", (24,), hello(instance=b"i"), "MALFORMED"),
        ("a text as instance", (24,), hello(instance="i" * 16), "MALFORMED"),
        ("a long token", (24,), hello(token=bytes(17)), "MALFORMED"),
        ("domain 233", (16,), hello(domain=233), "MALFORMED"),
        ("domain -1", (16,), hello(domain=-1), "MALFORMED"),
        ("domain true", (16,), hello(domain=True), "MALFORMED"),
        ("a text as domain", (16,), hello(domain="0"), "MALFORMED"),
        ("an empty client address", (83,), hello(client_address=""), "MALFORMED"),
        ("a name as client address", (83,), hello(client_address="localhost"), "MALFORMED"),
        ("a network as client address", (83,), hello(client_address="10.0.0.0/8"), "MALFORMED"),
        ("an integer as client address", (83,), hello(client_address=1), "MALFORMED"),
        ("bytes as client address", (83,), hello(client_address=b"\x7f\x00\x00\x01"), "MALFORMED"),
        ("nil as client address", (83,), hello(client_address=None), "MALFORMED"),
        ("a client address with a zone", (83,), hello(client_address="fe80::1%eth0"), "MALFORMED"),
        ("a long client address", (83,), hello(client_address="1" * 3000), "MALFORMED"),
        ("too large", (1, 4), hello(filler=bytes(5000)), "TOO_LARGE"),
    ):
        yield Case(f"HELLO: {name}", cases, "start", raw, f"ERROR {code}")
    yield Case("HELLO: a hostile agent", (20,), "start", hello(agent="\x1b[2J\nforged line"), "welcome")
    other = encode(frames.Hello(1, IDENTITY | {"token": b"x" * 16, "agent": "thief"}))
    yield Case("HELLO: an instance with another token", (24, 26), "start", other, "welcome")


BAD_NAMES: Final = {
    "empty": ((18,), ""),
    "a slash": ((18,), "/"),
    "relative": ((18,), "t"),
    "an empty token": ((18,), "/a//b"),
    "a slash at the end": ((18,), "/a/"),
    "2,000 characters": ((18,), "/" + "x" * 1999),
    "1,000 tokens": ((18,), "/a" * 1000),
    "a digit first": ((18,), "/1"),
    "a wildcard": ((19,), "/a/*"),
    "a wildcard of NATS": ((19,), "/a/>"),
    "a wildcard of MQTT": ((19,), "/a/#"),
    "made to backtrack": ((19,), "/" + "a_" * 900 + "!"),
    "a control character": ((20,), "/a\x1b[2J"),
    "a line end": ((20,), "/a\n"),
    "a zero byte": ((20,), "/a\0"),
    "letters of other scripts": ((20,), "/\u0430"),
    "a substitution": ((21,), "/{node}"),
    "a tilde": ((21,), "/~"),
}


def declaration_cases() -> Iterator[Case]:
    """Declarations that are refused, and references to what a link does not own."""
    for name, (cases, text) in BAD_NAMES.items():
        if name != "relative":
            yield Case(f"node: {name}", cases, "open", _send(frames.Node(9, text)), "REFUSED INVALID_NAME")
        for declaration in (
            make.publisher(9, text),
            make.subscription(9, text),
            make.service(9, text),
            make.client(9, text),
        ):
            title = f"{type(declaration).__name__.lower()}: {name}"
            yield Case(title, cases, "declared", _send(declaration), "REFUSED INVALID_NAME")
    others: tuple[tuple[str, tuple[int, ...], frames.Frame, str], ...] = (
        ("a name that is taken", (26,), frames.Node(9, "/n"), "REFUSED NAME_TAKEN"),
        ("the name of another link's node", (26,), frames.Node(9, "/bystander"), "REFUSED NAME_TAKEN"),
        ("a relative node name", (18,), frames.Node(9, "n2"), "REFUSED INVALID_NAME"),
        ("an id in use", (15,), make.publisher(1), "ERROR UNEXPECTED"),
        ("the node's id in use", (15,), frames.Node(0, "/n2"), "ERROR UNEXPECTED"),
        ("a node that is none", (15,), make.publisher(9, node=77), "REFUSED UNKNOWN_ID"),
        ("a publisher as node", (15,), make.publisher(9, node=1), "REFUSED UNKNOWN_ID"),
        ("a type of control characters", (20,), make.publisher(9, type_hash="\x1b"), "REFUSED MALFORMED"),
        ("a type of 2,000 characters", (18,), make.service(9, type_hash="x" * 2000), "REFUSED MALFORMED"),
        ("the greatest id", (15,), make.publisher(2**32 - 1), "open"),
        ("the greatest sequence number", (15,), make.publisher(9, next_sequence=2**64 - 1), "open"),
        ("UNDECLARE of nothing", (15,), frames.Undeclare(77), "open"),
        ("RETIRE of a publisher", (15,), frames.Retire(1), "open"),
        ("a batch of an unknown publisher", (24,), make.batch(2**63, 0), "ERROR UNKNOWN_ID"),
        ("ASSERT of an unknown publisher", (24,), frames.Assert(2**63), "ERROR UNKNOWN_ID"),
        ("CREDIT of an unknown publisher", (24,), frames.Credit(2**63, None, None), "ERROR UNKNOWN_ID"),
        ("a batch at the greatest number", (15,), make.batch(PUBLISHER, 2**64 - 1), "ERROR MALFORMED"),
        ("a reply to nothing", (25,), make.reply(3, 1), "open"),
        ("a reply of a client", (25,), make.reply(4, 1), "open"),
        ("a request of a server", (25,), make.request(3, 1), "open"),
        ("an unknown client's request", (25,), make.request(77, 1), "open"),
        ("a call that nobody serves", (28,), make.request(4, 1), "open"),
        ("CANCEL of nothing", (25,), frames.Cancel(4, (77,)), "open"),
        ("GRANT for nothing", (25,), frames.Grant(2, 2**63, 2**64 - 1, 2**64 - 1), "open"),
        ("GRANT of another's subscription", (25,), frames.Grant(77, PUBLISHER, 1, 1), "open"),
        ("UNWATCH of nothing", (15,), frames.Unwatch(77), "open"),
    )
    yield from (
        Case(name, numbers, "declared", _send(sent), expect) for name, numbers, sent, expect in others
    )
    keys = "history depth reliability durability liveliness deadline_ns lifespan_ns strict"
    for key in keys.split():
        for value in (-1, 2**63, "1", None, 0.5):
            raw = _send(make.subscription(9, qos={key: value}))
            yield Case(f"QoS: {key} is {value!r}", (16,), "declared", raw, "REFUSED MALFORMED")


def payload_cases() -> Iterator[Case]:
    """Batches whose payload contradicts their header, and fragments that do not add up."""

    def batch(length: int, ends: bytes | None, payload: bytes) -> bytes:
        return frame(Op.BATCH, [PUBLISHER, 0, 1, length, ends, None], payload)

    ones = array_head(2) + b"\x01\x01"
    two = (1).to_bytes(4, "little") + (2).to_bytes(4, "little")
    yield Case("a batch of two", (16,), "declared", batch(2, two, ones), "open")
    for name, raw in {
        "no payload": batch(1, None, b""),
        "an empty message": batch(1, None, array_head(1)),
        "another length": batch(1, None, array_head(2) + b"\x01"),
        "ends of a single message": batch(1, two[:4], array_head(1) + b"\x01"),
        "no ends": batch(2, None, ones),
        "too few ends": batch(2, two[:4], ones),
        "ends that fall": batch(2, two[4:] + two[:4], ones),
        "ends beyond the payload": batch(2, two[:4] + b"\xff\xff\xff\xff", ones),
        "an end of 0": batch(2, bytes(4) + two[4:], ones),
    }.items():
        yield Case(f"BATCH: {name}", (14, 16), "declared", raw, "ERROR MALFORMED")
    node, request = _send(frames.Node(9, "/n9")), _send(make.request(4, 1))
    for name, cases, sent, expect in (
        ("a request in fragments", (5,), _fragments(request), "open"),
        ("a node in a fragment", (17,), _fragments(node), "ERROR UNEXPECTED"),
        (
            "a fragment in a fragment",
            (11, 17),
            _fragments(_send(frames.Fragment(2, 9, True, b"x"))),
            "ERROR UNEXPECTED",
        ),
        ("nonsense in a fragment", (14,), _fragments(b"nonsense!"), "ERROR MALFORMED"),
        ("no first fragment", (14,), _send(frames.Fragment(1, None, True, b"x")), "ERROR MALFORMED"),
        ("an empty fragment", (14,), _send(frames.Fragment(1, 9, True, b"")), "ERROR MALFORMED"),
        ("more than the total", (31,), _send(frames.Fragment(1, 1, False, b"xx")), "ERROR MALFORMED"),
        ("less than the total", (31,), _send(frames.Fragment(1, 9, False, b"xx")), "ERROR MALFORMED"),
        ("a total of 0", (4,), _send(frames.Fragment(1, 0, True, b"x")), "ERROR MALFORMED"),
        ("a total of 4 GiB", (4, 47), _send(frames.Fragment(1, 2**32 - 1, True, b"x")), "ERROR TOO_LARGE"),
        (
            "two first fragments",
            (15,),
            _send(frames.Fragment(1, 9, True, b"x")) * 2,
            "ERROR MALFORMED",
        ),
        ("ABORT of nothing", (15,), _send(frames.Abort(77)), "open"),
        (
            "a fragment too many",
            (47,),
            b"".join(_send(frames.Fragment(n, 2**20, True, b"x")) for n in range(limits.MAX_TRANSFERS + 1)),
            "ERROR LIMIT",
        ),
    ):
        yield Case(name, cases, "declared", sent, expect)


def _send(sent: frames.Frame) -> bytes:
    return encode(sent)


def _fragments(inner: bytes) -> bytes:
    half = len(inner) // 2
    first = frames.Fragment(1, len(inner), True, inner[:half])
    return encode(first) + encode(frames.Fragment(1, None, False, inner[half:]))


FILES: Final = {
    "bytes": bytes_cases,
    "order": order_cases,
    "fields": field_cases,
    "declarations": declaration_cases,
    "payloads": payload_cases,
}


# Files

_RUN: Final = re.compile(rb"(.{1,8}?)\1{31,}", re.DOTALL)


def to_text(data: bytes) -> str:
    """Return bytes as hexadecimal digits; what is repeated often as `00*65537`, between spaces."""
    parts, start = [], 0
    for run in _RUN.finditer(data):
        parts += [data[start : run.start()].hex(), f"{run[1].hex()}*{len(run[0]) // len(run[1])}"]
        start = run.end()
    parts.append(data[start:].hex())
    text = " ".join(part for part in parts if part)
    return text.replace(f"cf{PUBLISHER:016x}", f" {PLACEHOLDER} ").replace("  ", " ").strip()


def from_text(text: str, publisher: int = 0) -> bytes:
    """Return the bytes that `to_text` has written, with the number of publisher 1."""
    data = b""
    for part in text.split():
        byte, _, times = part.partition("*")
        if part == PLACEHOLDER:
            data += b"\xcf" + publisher.to_bytes(8, "big")
        else:
            data += bytes.fromhex(byte) * int(times or 1)
    return data


def render(name: str) -> str:
    """Return the text of one file, with a case on each line."""
    states = {state: [to_text(part) for part in parts] for state, parts in STATES.items()}
    lines = [
        json.dumps(case._replace(send=to_text(case.send))._asdict())  # type: ignore[arg-type]
        for case in FILES[name]()
    ]
    body = ",\n".join(lines)
    return f'{{"states": {json.dumps(states)},\n"cases": [\n{body}\n]}}\n'


if __name__ == "__main__":
    DIRECTORY.mkdir(exist_ok=True)
    for each in FILES:
        (DIRECTORY / f"{each}.json").write_text(render(each), encoding="utf-8")
