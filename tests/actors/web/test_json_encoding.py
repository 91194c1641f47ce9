"""JSON that is made in pieces."""

from __future__ import annotations

import json
from typing import Any

import pytest

from actors.web.json_encoding import PIECE, encode_json


@pytest.mark.parametrize("size", [0, 1, PIECE, PIECE + 1, 3 * PIECE])
def test_pieces_make_the_document(size: int) -> None:
    """Maps and lists of all sizes, at all depths, and tuples."""
    numbers = list(range(size))
    document: dict[str, Any] = {
        "list": numbers,
        "map": {str(each): each for each in numbers},
        "nested": [[[[numbers], {"deep": numbers}]]],
        "empty": [[], {}, "", None],
        'a "quoted" name': {"x": [{"y": each} for each in numbers]},
    }
    assert json.loads(encode_json(document)) == document
    assert json.loads(encode_json(tuple(numbers))) == numbers


def test_numbers_that_json_lacks_are_null() -> None:
    """NaN and infinity."""
    assert encode_json({"x": [float("nan"), float("inf")]}) == b'{"x":[null,null]}'
