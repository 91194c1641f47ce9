"""How many requests a server gets, and what waits; the time is given."""

from __future__ import annotations

import math

from actors.bridges.request_window import ABANDONED_SEC, TAKEN_SEC, RequestWindow


def window(count: int, *, is_long: bool = False) -> RequestWindow[str]:
    """Return a window of two requests, with this many put into it; at most five wait, of 100 bytes."""
    made: RequestWindow[str] = RequestWindow(
        is_long=is_long, max_in_flight=2, max_waiting=5, max_waiting_bytes=100
    )
    for key in range(count):
        assert made.put(key, f"request {key}", 10) == ""
    return made


def sent(made: RequestWindow[str], now: float = 0.0) -> list[int]:
    """Return the requests that are sent now."""
    found: list[int] = []
    while (each := made.pop(now)) is not None:
        assert each[1] == f"request {each[0]}"
        found.append(each[0])
    return found


def test_each_response_makes_space_for_the_oldest_that_waits() -> None:
    """At most so many are in flight."""
    made = window(4)
    assert sent(made) == [0, 1]
    made.responded(1)
    assert sent(made) == [2]
    made.responded(0)
    made.responded(2)
    made.responded(2)
    assert sent(made) == [3]
    assert (made.in_flight, made.waiting, made.waiting_bytes) == (1, 0, 0)


def test_what_does_not_fit_is_refused() -> None:
    """By number, and by size; a single request may have any size."""
    made = window(5)
    assert made.put(5, "", 1) == "5 requests wait already"
    assert made.waiting == 5
    made = window(0)
    assert made.put(0, "request 0", 1000) == ""
    assert made.put(1, "", 1) == "requests of 1000 bytes wait already"
    assert sent(made) == [0]
    assert made.put(1, "request 1", 1) == ""


def test_a_waiting_request_frees_its_place_when_its_caller_gives_up() -> None:
    """It is never sent."""
    made = window(5)
    made.abandon(1, 0.0)
    made.abandon(77, 0.0)
    assert made.put(5, "request 5", 10) == ""
    assert sent(made) == [0, 2]
    assert made.waiting_bytes == 30


def test_a_sent_request_counts_for_some_time_when_its_caller_has_given_up() -> None:
    """The server may still have it, or never."""
    made = window(4)
    assert sent(made) == [0, 1]
    assert made.next_space() == math.inf
    made.abandon(0, 5.0)
    assert made.next_space() == 5.0 + ABANDONED_SEC
    assert sent(made, 5.0 + ABANDONED_SEC - 0.1) == []
    assert sent(made, 5.0 + ABANDONED_SEC) == [2]
    made.responded(1)
    made.responded(0)  # late
    assert sent(made, 20.0) == [3]
    assert made.next_space() == math.inf


def test_a_request_with_a_long_response_counts_until_it_is_taken() -> None:
    """Results of goals: any number of them, but not all at once."""
    made = window(5, is_long=True)
    assert sent(made, 1.0) == [0, 1]
    assert made.next_space() == 1.0 + TAKEN_SEC
    made.abandon(0, 1.0)
    assert made.next_space() == 1.0 + TAKEN_SEC
    assert sent(made, 1.0 + TAKEN_SEC) == [2, 3]
    made.responded(2)
    assert sent(made, 1.0 + TAKEN_SEC) == [4]


def test_a_server_that_is_gone_gives_nothing_back() -> None:
    """What it had counts no more; what waits is returned once."""
    made = window(5)
    assert sent(made) == [0, 1]
    made.forget_in_flight()
    assert sent(made) == [2, 3]
    assert made.pop_waiting() == [4]
    assert made.pop_waiting() == []
    assert (made.waiting, made.waiting_bytes, made.in_flight) == (0, 0, 2)
    made.clear()
    assert made.in_flight == 0
