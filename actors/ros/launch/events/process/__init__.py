"""Events of processes."""

from __future__ import annotations

from actors.launch.planning.events import (
    ProcessEvent,
    ProcessExited as ProcessExited,
    ProcessIO as ProcessIO,
    ProcessStarted as ProcessStarted,
)
from actors.ros.launch.unsupported import unsupported, unsupported_event

_MATCHERS = "give the event handler a target_action, or a matcher that looks at the event"

matches_name = unsupported("matches_name", _MATCHERS)
matches_pid = unsupported("matches_pid", _MATCHERS)
matches_executable = unsupported("matches_executable", _MATCHERS)
RunningProcessEvent = ProcessEvent
ProcessStdin = unsupported("ProcessStdin", "the stdin of processes is empty")
ProcessStdout = ProcessIO
ProcessStderr = ProcessIO
ShutdownProcess = unsupported_event("ShutdownProcess", "a launch stops its processes together, with Shutdown")
SignalProcess = unsupported_event("SignalProcess", "a launch stops its processes together, with Shutdown")
