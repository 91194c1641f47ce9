"""What `--json` prints of a message is read back equal by the verbs that take values, whatever its type."""

from __future__ import annotations

import json
import random
from typing import TYPE_CHECKING, Any, Final, cast

import pytest

from actors.cli.documents import Documents
from actors.cli.output import print_json
from actors.cli.values import message_from_text
from actors.interfaces.catalog import interfaces_of, standard_packages
from actors.interfaces.codec import codec_for
from actors.interfaces.convert import message_from_fields, message_to_ordereddict
from actors.interfaces.fields import fields_of
from actors.interfaces.literals import INTEGER_RANGE
from actors.interfaces.registry import find_interface

if TYPE_CHECKING:
    from collections.abc import Iterator

    from actors.interfaces.fields import FieldType
    from actors.interfaces.message import Message

FLOATS: Final = (0.0, -0.0, 0.1, -1.5, 1e300, 5e-324, 1e22, float("nan"), float("inf"), float("-inf"))
TEXTS: Final = (
    "",
    "1e3",
    "yes",
    "nan",
    "null",
    "'\"\\/",
    "two\nlines\r\n---\n",
    "\x00\x1b\x7f\x85\u2028",
    "🦾é",
)
SEEDS: Final = 8


def classes_of(name: str) -> Iterator[type[Message]]:
    """Yield the messages of an interface: itself, or those of a service or an action."""
    found: Any = find_interface(name)
    parts = {"srv": ("Request", "Response"), "action": ("Goal", "Result", "Feedback"), "msg": ()}
    names = parts[name.split("/")[1]]
    yield from (getattr(found, each) for each in names) if names else (found,)


def value_of(kind: FieldType, chance: random.Random) -> Any:
    """Return a value of a field, often one at a limit."""
    if not kind.is_array:
        return scalar_of(kind, chance)
    most = chance.choice((0, 1, 5)) if kind.high is None else kind.high
    items = [
        scalar_of(kind, chance) for _ in range(most if kind.is_fixed else chance.randint(kind.low, most))
    ]
    if kind.base == "byte":
        return b"".join(items)
    return items


def scalar_of(kind: FieldType, chance: random.Random) -> Any:
    """Return one value of a field, or an element of its sequence."""
    if kind.message is not None:
        return values_of(cast("type[Message]", kind.message), chance)
    if kind.base == "bool":
        return chance.random() < 0.5
    if kind.base == "byte":
        return bytes([chance.choice((0, 10, 127, 255, ord("5")))])
    if kind.base in INTEGER_RANGE:
        low, high = INTEGER_RANGE[kind.base]
        return chance.choice((low, high, 0, chance.randint(low, high)))
    if kind.base in {"float32", "float64"}:
        return chance.choice(FLOATS)
    text = chance.choice(TEXTS)
    return text[: kind.string_bound] if kind.string_bound else text


def values_of(msg_type: type[Message], chance: random.Random) -> dict[str, Any]:
    """Return values of all fields of a message."""
    return {field.name: value_of(field.type, chance) for field in fields_of(msg_type)}


@pytest.mark.parametrize("package", standard_packages())
def test_printed_messages_are_read_back(package: str, capsys: pytest.CaptureFixture[str]) -> None:
    """Every type of a package, with NaN, infinities, bytes, 64-bit integers and odd texts."""
    for name in interfaces_of(package):
        for msg_type in classes_of(name):
            for seed in range(SEEDS):
                message = message_from_fields(msg_type, values_of(msg_type, random.Random(seed)))
                print_json(message_to_ordereddict(message))
                printed = capsys.readouterr().out
                json.loads(printed, parse_constant=pytest.fail)  # JSON for everybody, without NaN
                assert Documents().feed(printed) == [printed]
                read = message_from_text(msg_type, printed)
                encode = codec_for(msg_type).encode
                assert encode(read) == encode(message), (name, printed)
