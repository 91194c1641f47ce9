"""QoS maps: valid values, and incompatible pairs."""

from __future__ import annotations

import pytest

from proto.wire.codes import PolicyKind
from proto.wire.qos import Refusal, incompatible_policy, parse_qos

MS = 1_000_000


def test_an_empty_map_is_the_default() -> None:
    """Missing keys are KEEP_LAST, 10, RELIABLE, VOLATILE, AUTOMATIC, no times, not strict; sent as such."""
    qos = parse_qos({})
    assert qos == (1, 10, 1, 2, 1, 0, 0, 0, False)
    assert qos.to_map() == {"history": 1, "depth": 10, "reliability": 1, "durability": 2}
    full = {"deadline_ns": 5, "lifespan_ns": 6, "lease_ns": 7, "liveliness": 3, "strict": True}
    assert parse_qos(full).to_map() == {**qos.to_map(), **full}


@pytest.mark.parametrize(
    "options",
    [
        {"history": 3},
        {"depth": -1},
        {"depth": 2_000_000},
        {"liveliness": 2},
        {"deadline_ns": -1},
        {"lifespan_ns": 2**63},
        {"lease_ns": 1.5},
        {"lease_ns": True},
        {"strict": 1},
    ],
)
def test_a_wrong_value_is_refused_by_name(options: dict[str, int | float]) -> None:
    """The text names the key and what it may be."""
    with pytest.raises(Refusal, match=next(iter(options))):
        parse_qos(options)


@pytest.mark.parametrize(
    ("valid", "wrong"), [({"depth": 1}, {"depth": True}), ({"lease_ns": 7}, {"lease_ns": 7.0})]
)
def test_a_wrong_value_is_refused_after_an_equal_valid_one(
    valid: dict[str, int], wrong: dict[str, float]
) -> None:
    """Maps that have been parsed before are known by the types of their values, too."""
    assert valid == wrong
    parse_qos(valid)
    with pytest.raises(Refusal, match=next(iter(wrong))):
        parse_qos(wrong)


@pytest.mark.parametrize(
    ("publisher", "subscription", "policy"),
    [
        ({}, {}, None),
        ({"reliability": 2}, {}, PolicyKind.RELIABILITY),
        ({"reliability": 2}, {"reliability": 2}, None),
        ({"durability": 2}, {"durability": 1}, PolicyKind.DURABILITY),
        ({"durability": 1}, {"durability": 2}, None),
        ({"deadline_ns": 100 * MS}, {}, None),
        ({}, {"deadline_ns": 100 * MS}, PolicyKind.DEADLINE),
        ({"deadline_ns": 100 * MS}, {"deadline_ns": 99 * MS}, PolicyKind.DEADLINE),
        ({"deadline_ns": 100 * MS}, {"deadline_ns": 100 * MS}, None),
        ({"lease_ns": 100 * MS}, {"lease_ns": 99 * MS}, PolicyKind.LIVELINESS_LEASE_DURATION),
        ({"lease_ns": 100 * MS}, {"lease_ns": 101 * MS}, None),
        ({}, {"liveliness": 3}, PolicyKind.LIVELINESS),
        ({"liveliness": 3}, {"liveliness": 1}, None),
        ({"lifespan_ns": 5}, {"lifespan_ns": 1}, None),
        ({"reliability": 2}, {"durability": 1, "deadline_ns": 1}, PolicyKind.DURABILITY),
    ],
)
def test_what_a_publisher_must_offer(
    publisher: dict[str, int], subscription: dict[str, int], policy: PolicyKind | None
) -> None:
    """The last policy for which a subscription requests more is returned."""
    assert incompatible_policy(parse_qos(publisher), parse_qos(subscription)) == policy
