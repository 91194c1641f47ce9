"""What tf2_ros's Python needs of tf2_py: transforms by their two frames, the last one of each."""

from __future__ import annotations

from typing import Any

from actors.time.types import Time


class TransformException(Exception):  # noqa: N818 - tf2_py has it
    """Base of the errors."""


class LookupException(TransformException):
    """There is no such transform."""


class ConnectivityException(TransformException):
    """Not raised here."""


class ExtrapolationException(TransformException):
    """Not raised here."""


class InvalidArgumentException(TransformException):
    """Not raised here."""


class TimeoutException(TransformException):
    """Raised by tf2_ros."""


class BufferCore:
    """Keeps transforms."""

    def __init__(self, cache_time: Any = None) -> None:
        del cache_time
        self._transforms: dict[frozenset[str], Any] = {}

    def set_transform(self, transform: Any, authority: str) -> None:
        """Keep a transform."""
        del authority
        self._transforms[frozenset((transform.header.frame_id, transform.child_frame_id))] = transform

    set_transform_static = set_transform

    def lookup_transform_core(self, target_frame: str, source_frame: str, time: Any) -> Any:
        """Return the transform between two frames."""
        del time
        try:
            return self._transforms[frozenset((target_frame, source_frame))]
        except KeyError:
            raise LookupException(f"no transform from {source_frame} to {target_frame}") from None

    def lookup_transform_full_core(
        self, target_frame: str, target_time: Any, source_frame: str, source_time: Any, fixed_frame: str
    ) -> Any:
        """Return the same."""
        del source_time, fixed_frame
        return self.lookup_transform_core(target_frame, source_frame, target_time)

    def can_transform_core(self, target_frame: str, source_frame: str, time: Any) -> tuple[bool, str]:
        """Return whether there is a transform."""
        del time
        return frozenset((target_frame, source_frame)) in self._transforms, ""

    def can_transform_full_core(
        self, target_frame: str, target_time: Any, source_frame: str, source_time: Any, fixed_frame: str
    ) -> tuple[bool, str]:
        """Return the same."""
        del source_time, fixed_frame
        return self.can_transform_core(target_frame, source_frame, target_time)

    def get_latest_common_time(self, target_frame: str, source_frame: str) -> Time:
        """Return the time of the transform."""
        return Time.from_msg(self.lookup_transform_core(target_frame, source_frame, None).header.stamp)

    def clear(self) -> None:
        """Forget all."""
        self._transforms.clear()

    def all_frames_as_yaml(self) -> str:
        """Return nothing."""
        return ""
