"""Says which fields a message has after a mistyped keyword, as msgspec's error names neither type nor fields.

The check itself is msgspec's, in C. Wrapping it would cost every message that is made, so that the class is
looked up here, where the error is reported: in the source of the call that raised it.
"""

from __future__ import annotations

import ast
import linecache
import re
from itertools import islice
from types import ModuleType
from typing import TYPE_CHECKING, Final

from actors.interfaces.naming import MessageType, message_name

if TYPE_CHECKING:
    from types import TracebackType

_UNEXPECTED: Final = re.compile(r"Unexpected keyword argument '(\w+)'")


def add_keyword_hint(error: BaseException) -> None:
    """Add a note with the fields to an error about an unknown keyword of a message class.

    Args:
        error: Any error; others are left alone.
    """
    found = _UNEXPECTED.fullmatch(str(error)) if type(error) is TypeError else None
    if found is None or error.__traceback__ is None or hasattr(error, "__notes__"):
        return
    cls = _called(error.__traceback__)
    if not isinstance(cls, MessageType):
        return
    from difflib import get_close_matches  # noqa: PLC0415 - takes a millisecond, and is seldom needed

    fields = cls.__struct_fields__
    close = get_close_matches(found[1], fields, 1)
    hint = f"did you mean '{close[0]}'? " if close else ""
    listed = f"it has: {', '.join(fields)}" if fields else "it has none"
    error.add_note(f"{message_name(cls)} has no field '{found[1]}'; {hint}{listed}")


def _called(traceback: TracebackType) -> object:
    """Return what the last call of a traceback has called; None if its source does not tell."""
    while traceback.tb_next is not None:
        traceback = traceback.tb_next
    frame = traceback.tb_frame
    positions = next(islice(frame.f_code.co_positions(), traceback.tb_lasti // 2, None), (None,) * 4)
    try:
        tree = ast.parse(_source(frame.f_code.co_filename, *positions), mode="eval").body
    except (SyntaxError, ValueError):
        return None
    names: list[str] = []
    node = tree.func if isinstance(tree, ast.Call) else tree
    while isinstance(node, ast.Attribute):
        names.append(node.attr)
        node = node.value
    if not isinstance(node, ast.Name):
        return None
    found = frame.f_locals.get(node.id, frame.f_globals.get(node.id))
    # Only of modules and classes: attributes of other objects may run the user's code.
    while names and isinstance(found, ModuleType | type):
        found = getattr(found, names.pop(), None)
    return None if names else found


def _source(file: str, first: int | None, last: int | None, begin: int | None, end: int | None) -> str:
    """Return a piece of a file's text, between lines and columns, which count bytes.

    Raises:
        ValueError: The file or the position is not known.
    """
    if first is None or last is None:
        raise ValueError("no position")
    lines = [line.encode() for line in linecache.getlines(file)[first - 1 : last]]
    if not lines:
        raise ValueError("no source")
    lines[-1] = lines[-1][:end]
    lines[0] = lines[0][begin:]
    return b"".join(lines).decode()
