"""Events of processes."""

from __future__ import annotations

from actors.launch.planning.events import (
    ProcessEvent,
    ProcessExited as ProcessExited,
    ProcessIO as ProcessIO,
    ProcessStarted as ProcessStarted,
)
from actors.ros.launch.unsupported import unsupported

RunningProcessEvent = ProcessEvent
ProcessStdin = unsupported("ProcessStdin", "the stdin of processes is empty")
ProcessStdout = ProcessIO
ProcessStderr = ProcessIO
ShutdownProcess = unsupported("ShutdownProcess", "a launch stops its processes together, with Shutdown")
SignalProcess = unsupported("SignalProcess", "a launch stops its processes together, with Shutdown")
