"""Free space in a block of memory: what is allocated never overlaps, and nothing gets lost."""

from __future__ import annotations

from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st

from proto.queues.extents import PAGE_BYTES, Extents, rounded

START, END = PAGE_BYTES, 33 * PAGE_BYTES


STEPS = st.sampled_from(["allocate", "allocate", "grow", "free"])


@given(st.lists(st.tuples(STEPS, st.integers(1, 12 * PAGE_BYTES), st.integers(0, 100))))
def test_allocations_never_overlap_and_all_space_comes_back(steps: list[tuple[str, int, int]]) -> None:
    """At every moment the parts in use are apart, inside the block, and leave what `free_bytes` says."""
    extents = Extents(START, END)
    used: list[tuple[int, int]] = []
    for step, size, choice in steps:
        if step == "allocate":
            start = extents.allocate(size)
            if start is not None:
                used.append((start, size))
        elif used and step == "free":
            extents.free(*used.pop(choice % len(used)))
        elif used:
            start, before = used[choice % len(used)]
            if extents.extend(start, before, before + size):
                used[choice % len(used)] = start, before + size
        parts = sorted((start, start + rounded(size)) for start, size in used)
        assert all(stop <= start for (_, stop), (start, _) in pairwise(parts))
        assert all(start >= START and stop <= END for start, stop in parts)
        assert extents.free_bytes == END - START - sum(stop - start for start, stop in parts)
    for start, size in used:
        extents.free(start, size)
    assert extents.allocate(END - START) == START  # all of it is one part again


def test_a_part_grows_into_free_space_behind_it_only() -> None:
    """What it grows by is not free any more."""
    extents = Extents(START, END)
    start = extents.allocate(PAGE_BYTES)
    assert start is not None
    assert extents.extend(start, PAGE_BYTES, 3 * PAGE_BYTES)
    assert extents.free_bytes == END - START - 3 * PAGE_BYTES
    assert extents.allocate(PAGE_BYTES) == START + 3 * PAGE_BYTES
    assert not extents.extend(start, 3 * PAGE_BYTES, 4 * PAGE_BYTES)
    assert extents.free_bytes == END - START - 4 * PAGE_BYTES


def test_the_lowest_part_that_fits_is_used_again() -> None:
    """The memory that was used first is used again first, so that the upper end stays untouched."""
    extents = Extents(START, END)
    first, second = extents.allocate(PAGE_BYTES), extents.allocate(2 * PAGE_BYTES)
    assert (first, second) == (START, START + PAGE_BYTES)
    extents.free(START, 1)
    assert extents.allocate(2 * PAGE_BYTES) == START + 3 * PAGE_BYTES
    assert extents.allocate(1) == START


def test_a_part_larger_than_any_free_one_is_refused() -> None:
    """Free parts that are not next to each other do not add up."""
    extents = Extents(0, 3 * PAGE_BYTES)
    starts = [extents.allocate(PAGE_BYTES) for _ in range(3)]
    assert starts == [0, PAGE_BYTES, 2 * PAGE_BYTES]
    extents.free(0, PAGE_BYTES)
    extents.free(2 * PAGE_BYTES, PAGE_BYTES)
    assert extents.allocate(2 * PAGE_BYTES) is None
    extents.free(PAGE_BYTES, PAGE_BYTES)
    assert extents.allocate(3 * PAGE_BYTES) == 0
