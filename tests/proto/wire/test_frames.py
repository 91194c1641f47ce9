"""The grammar as data: complete, and in step with the frames' classes."""

from __future__ import annotations

from typing import cast, get_args

import pytest

from proto import limits
from proto.wire import field_kinds as kinds
from proto.wire import frames
from proto.wire.codes import Op
from proto.wire.frames import OPCODES, SPECS, Frame

PAYLOADS = {Op.BATCH: ("payload", "raw"), Op.REPLAY: ("payload",), Op.FRAGMENT: ("payload",)}


def test_every_opcode_has_a_spec_and_every_frame_an_opcode() -> None:
    """§8: opcodes, specs and the Frame union name the same frames."""
    assert set(SPECS) == set(Op)
    assert set(OPCODES) == set(get_args(Frame))
    assert all(SPECS[op].frame is frame for frame, op in OPCODES.items())


def test_opcodes_fit_one_byte_and_headers_a_fixarray() -> None:
    """§3.2: an opcode is a positive fixint and a header has at most 15 elements."""
    assert all(0 < op < 128 for op in Op)
    assert all(1 + len(spec.kinds) <= 15 for spec in SPECS.values())


@pytest.mark.parametrize("op", list(Op), ids=lambda op: op.name)
def test_specs_name_each_field_of_the_class(op: Op) -> None:
    """Each field of the class has one kind, in order; payload fields come last."""
    spec = SPECS[op]
    fields = cast("type[frames.Ping]", spec.frame)._fields
    assert len(fields) == len(spec.kinds) + len(PAYLOADS.get(op, ()))
    assert fields[len(spec.kinds) :] == PAYLOADS.get(op, ())
    assert spec.has_payload == (op in PAYLOADS)
    assert set(spec.kinds) <= set(kinds.KINDS)


def test_class_names_are_the_opcodes_names() -> None:
    """§8: a frame is called by its opcode's name."""
    assert all(frame.__name__.upper() == Op(op).name for frame, op in OPCODES.items())


def test_every_kind_is_used() -> None:
    """No kind is left over."""
    assert {kind for spec in SPECS.values() for kind in spec.kinds} == set(kinds.KINDS)


def test_limits_fit_together() -> None:
    """What we send stays below what we accept."""
    assert limits.BATCH_FLUSH_COUNT <= limits.MAX_BATCH_COUNT
    assert limits.BATCH_FLUSH_BYTES + 4 * limits.BATCH_FLUSH_COUNT < limits.MAX_FRAME_BYTES
    assert limits.FRAGMENT_BYTES < limits.MAX_FRAME_BYTES
    assert limits.MAX_CALLS_PER_FRAME <= limits.MAX_HEADER_ARRAY
    assert 4 * limits.MAX_BATCH_COUNT < limits.MAX_HEADER_BYTES <= limits.MAX_FRAME_BYTES
    assert 4 * limits.MAX_ERROR_TEXT <= limits.MAX_HEADER_STRING_BYTES
    assert limits.LOW_WATER_BYTES < limits.HIGH_WATER_BYTES
    assert limits.MAX_FRAME_BYTES < limits.MAX_MESSAGE_BYTES
