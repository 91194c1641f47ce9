"""What the comparison of the ways with ARCHITECTURE.md finds."""

from __future__ import annotations

from tests.ways import Way, faults

DOCUMENT = """
### A call: 2 files, 1,000 calls

It starts in `client.py` and ends in `broker/routing/calls.py`; `make check` is no file.

### Elsewhere

`never.py` belongs to no operation.
"""
CALL = Way(["actors/endpoints/client/client.py", "broker/routing/calls.py"], 1100)


def test_what_a_document_says_wrongly_is_found() -> None:
    """The number of files, more calls, a file that is not entered, and a way that is missing."""
    assert not list(faults(DOCUMENT, {"A call": CALL}))
    assert not list(faults(DOCUMENT, {"A call": CALL._replace(calls=10)}))
    assert list(faults(DOCUMENT, {"A call": CALL._replace(calls=1101)})) == [
        "A call: costs 1101 calls, not 1000"
    ]
    others = (f"proto/{each}.py" for each in "abcde")
    files = ["actors/endpoints/service/endpoint.py", *CALL.files[1:], *others]
    assert list(faults(DOCUMENT, {"A call": CALL._replace(files=files), "A goal": CALL})) == [
        "A call: enters 7 files, not 2",
        "A call: does not enter client.py",
        "A goal: no heading says how many files and calls",
    ]
