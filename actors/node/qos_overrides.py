"""QoS of publishers and subscriptions from parameters: `-p qos_overrides./chatter.publisher.depth:=5`.

As in rclpy, an endpoint takes part only if it is made with `QoSOverridingOptions`. Each policy that may be
overridden is then a read-only parameter, `qos_overrides.<topic>.<publisher or subscription>[_<id>].<policy>`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final, Literal

from actors.parameters.errors import InvalidParameterValueError
from actors.parameters.types import ParameterDescriptor
from actors.qos.compatibility import QoSPolicyKind
from actors.qos.profile import InvalidQoSProfileError, QoSPolicyEnum, QoSProfile
from actors.time.types import Duration

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from actors.parameters.callbacks import SetParametersOutcome
    from actors.parameters.store import ParameterStore
    from actors.parameters.types import ParameterValue

DEFAULT_POLICIES: Final = (QoSPolicyKind.HISTORY, QoSPolicyKind.DEPTH, QoSPolicyKind.RELIABILITY)


@dataclass(frozen=True, slots=True)
class QoSOverridingOptions:
    """Which policies of a publisher or subscription may be overridden by parameters.

    Attributes:
        policy_kinds: The policies.
        callback: Accepts or refuses the resulting profile; None accepts every profile.
        entity_id: Distinguishes several endpoints of a node on one topic.
    """

    policy_kinds: Sequence[QoSPolicyKind]
    callback: Callable[[QoSProfile], SetParametersOutcome] | None = None
    entity_id: str = ""

    @classmethod
    def with_default_policies(
        cls, *, callback: Callable[[QoSProfile], SetParametersOutcome] | None = None, entity_id: str = ""
    ) -> QoSOverridingOptions:
        """Return options for history, depth and reliability.

        Args:
            callback: Accepts or refuses the resulting profile; None accepts every profile.
            entity_id: Distinguishes several endpoints of a node on one topic.

        Returns:
            The options.
        """
        return cls(DEFAULT_POLICIES, callback, entity_id)


def overridden(
    qos: QoSProfile,
    options: QoSOverridingOptions | None,
    parameters: ParameterStore,
    topic: str,
    kind: Literal["publisher", "subscription"],
) -> QoSProfile:
    """Declare the parameters of an endpoint; return its profile with their values.

    Args:
        qos: The profile in the code, whose policies are the defaults.
        options: What may be overridden; None for nothing.
        parameters: Those of the node.
        topic: The full name of the topic.
        kind: Which endpoint.

    Raises:
        InvalidParameterTypeError: An override has another type than the policy.
        InvalidParameterValueError: There is no such policy or duration.
        InvalidQoSProfileError: The callback refuses the profile.
    """
    if options is None:
        return qos
    suffix = f"_{options.entity_id}" if options.entity_id else ""
    changes: dict[str, Any] = {}
    for policy in options.policy_kinds:
        if policy is QoSPolicyKind.LIFESPAN and kind == "subscription":
            continue  # a publisher's alone
        field = policy.name.lower()
        name = f"qos_overrides.{topic}.{kind}{suffix}.{field}"
        # Declared already by another endpoint of this node on the same topic and with the same id: they
        # share it.
        if not parameters.has(name):
            # Read-only: the QoS of an endpoint is declared once, and a value that is set later would have
            # no effect.
            fixed = ParameterDescriptor(read_only=True)
            parameters.declare(name, _plain(getattr(qos, field)), fixed)
        value = parameters.get(name).value
        try:
            changes[field] = _policy(getattr(qos, field), value)
        except (InvalidQoSProfileError, OverflowError, ValueError) as error:
            raise InvalidParameterValueError(name, value, str(error)) from None
    try:
        # All at once, because policies depend on each other (history and depth), and the order in which
        # they are listed must not matter.
        profile = replace(qos, **changes)
    except InvalidQoSProfileError as error:
        raise InvalidQoSProfileError(f"{error.reason} (of qos_overrides.{topic}.{kind}{suffix})") from None
    if options.callback is not None and not (outcome := options.callback(profile)).successful:
        raise InvalidQoSProfileError(outcome.reason or f"the callback refuses the overrides of {topic}")
    return profile


def _plain(policy: QoSPolicyEnum | Duration | int) -> ParameterValue:
    """Return a policy as a parameter: its key, or a time in nanoseconds."""
    if isinstance(policy, QoSPolicyEnum):
        return policy.short_key
    return policy.nanoseconds if isinstance(policy, Duration) else policy


def _policy(default: QoSPolicyEnum | Duration | int, value: Any) -> QoSPolicyEnum | Duration | int:
    """Return a parameter's value as a policy of the default's type."""
    if isinstance(default, QoSPolicyEnum):
        return type(default).get_from_short_key(value)
    return Duration(nanoseconds=value) if isinstance(default, Duration) else int(value)
