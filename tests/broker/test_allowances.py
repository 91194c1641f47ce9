"""The least of what many subscriptions allow, whatever comes, rises and goes."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from broker.allowances import Allowances

Step = tuple[str, int, int, int]

STEPS = st.tuples(
    st.sampled_from(["add", "grant", "grant", "remove"]),
    st.integers(0, 5),
    st.integers(0, 50),
    st.integers(0, 50),
)


@given(steps=st.lists(STEPS, max_size=80))
def test_the_least_is_the_least(steps: list[Step]) -> None:
    """After each step it is what looking at all of them would find."""
    allowances, model = Allowances(), dict[int, tuple[int, int]]()
    for what, key, sequence, size in steps:
        if what == "add" and key not in model:
            allowances.add(key, sequence, size, 100 * key)
            model[key] = sequence, size + 100 * key
        elif what == "grant":
            allowances.grant(key, sequence, size)
            if key in model:
                before = model[key]
                model[key] = max(before[0], sequence), max(before[1], size + 100 * key)
        elif what == "remove":
            assert allowances.remove(key) == (model.pop(key, None) is not None)
        least = (min(s for s, _ in model.values()), min(b for _, b in model.values())) if model else None
        assert allowances.least() == least


def test_coming_and_going_leaves_nothing_behind() -> None:
    """A subscription that is suspended and restored for ever does not make the heaps grow for ever."""
    allowances = Allowances()
    allowances.add(0, 1, 1, 0)
    for turn in range(1000):
        allowances.add(1, turn + 5, turn + 5, 0)
        allowances.remove(1)
    assert len(allowances._sequences._heap) < 20
    assert allowances.least() == (1, 1)
