"""QoS of publishers and subscriptions from parameters, such as `qos_overrides./chatter.publisher.depth`."""

from __future__ import annotations

from typing import Literal, Self, TYPE_CHECKING, TypeAlias

from actors.interfaces.rcl_interfaces.msg import SetParametersResult
from actors.node import qos_overrides as native
from actors.qos.compatibility import QoSPolicyKind as QoSPolicyKind
from actors.qos.profile import InvalidQoSProfileError
from actors.ros.rclpy.qos import QoSProfile

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from actors.parameters.callbacks import SetParametersOutcome
    from actors.parameters.store import ParameterStore
    from actors.qos.profile import QoSProfile as NativeProfile

    QosCallbackType: TypeAlias = "Callable[[QoSProfile], QosCallbackResult]"

QosCallbackResult: TypeAlias = SetParametersResult


class InvalidQosOverridesError(Exception):
    """The callback refuses the profile, or the overrides do not fit together."""


class QoSOverridingOptions:
    """Which policies of a publisher or subscription may be overridden by parameters.

    Args:
        policy_kinds: The policies.
        callback: Accepts or refuses the resulting profile; None accepts every profile.
        entity_id: Distinguishes several endpoints of a node on one topic.
    """

    def __init__(
        self,
        policy_kinds: Iterable[QoSPolicyKind],
        *,
        callback: QosCallbackType | None = None,
        entity_id: str | None = None,
    ) -> None:
        # A tuple: the argument may be a generator, and is read for each endpoint that shares these options.
        self._policy_kinds = tuple(policy_kinds)
        self._callback = callback
        self._entity_id = entity_id

    @property
    def policy_kinds(self) -> Iterable[QoSPolicyKind]:
        """The policies."""
        return self._policy_kinds

    @property
    def callback(self) -> QosCallbackType | None:
        """Accepts or refuses the resulting profile."""
        return self._callback

    @property
    def entity_id(self) -> str | None:
        """Distinguishes several endpoints of a node on one topic."""
        return self._entity_id

    @classmethod
    def with_default_policies(
        cls, *, callback: QosCallbackType | None = None, entity_id: str | None = None
    ) -> Self:
        """Return options for history, depth and reliability."""
        return cls(native.DEFAULT_POLICIES, callback=callback, entity_id=entity_id)

    def native(self) -> native.QoSOverridingOptions:
        """Return callboard's options; the callback gets rclpy's profile."""
        callback = self._callback

        def decide(profile: NativeProfile) -> SetParametersOutcome:
            assert callback is not None
            return callback(QoSProfile.from_native(profile))

        return native.QoSOverridingOptions(
            self._policy_kinds, None if callback is None else decide, self._entity_id or ""
        )


def overridden(
    profile: QoSProfile,
    options: QoSOverridingOptions,
    parameters: ParameterStore,
    topic: str,
    kind: Literal["publisher", "subscription"],
) -> QoSProfile:
    """Declare the parameters of an endpoint; return its profile with their values.

    Args:
        profile: The profile in the code.
        options: The policies that may be overridden.
        parameters: The node's parameters.
        topic: The full name of the topic.
        kind: Which endpoint.

    Raises:
        InvalidParameterTypeException: An override has another type than the policy.
        InvalidParameterValueException: There is no such policy or duration.
        InvalidQosOverridesError: The callback refuses the profile, or the overrides do not fit together.
    """
    try:
        made = native.overridden(profile.native(), options.native(), parameters, topic, kind)
    except InvalidQoSProfileError as error:
        raise InvalidQosOverridesError(
            f"QoS overrides for {kind} '{topic}' are not valid: {error.reason}"
        ) from None
    return QoSProfile.from_native(made)
