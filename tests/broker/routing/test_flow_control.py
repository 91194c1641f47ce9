"""The least of the limits of many subscriptions, after any changes."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from broker.routing.flow_control import CreditLimits
from tests.seams.brokers import heap_length

Step = tuple[str, int, int, int]

STEPS = st.tuples(
    st.sampled_from(["add", "grant", "grant", "remove"]),
    st.integers(0, 5),
    st.integers(0, 50),
    st.integers(0, 50),
)


@given(steps=st.lists(STEPS, max_size=80))
def test_the_least_limit_is_the_minimum(steps: list[Step]) -> None:
    """After each step it equals the minimum over all subscriptions."""
    credit_limits, model = CreditLimits(), dict[int, tuple[int, int]]()
    for what, key, sequence, size in steps:
        if what == "add" and key not in model:
            credit_limits.add(key, sequence, size, 100 * key)
            model[key] = sequence, size + 100 * key
        elif what == "grant":
            credit_limits.grant(key, sequence, size)
            if key in model:
                before = model[key]
                model[key] = max(before[0], sequence), max(before[1], size + 100 * key)
        elif what == "remove":
            assert credit_limits.remove(key) == (model.pop(key, None) is not None)
        least = (min(s for s, _ in model.values()), min(b for _, b in model.values())) if model else None
        assert credit_limits.least() == least


def test_coming_and_going_leaves_nothing_behind() -> None:
    """Suspending and restoring a subscription repeatedly does not grow the heaps."""
    credit_limits = CreditLimits()
    credit_limits.add(0, 1, 1, 0)
    for count in range(1000):
        credit_limits.add(1, count + 5, count + 5, 0)
        credit_limits.remove(1)
    assert heap_length(credit_limits) < 20
    assert credit_limits.least() == (1, 1)
