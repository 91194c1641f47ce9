"""Events of processes."""

from __future__ import annotations

from actors.launch.planning.events import (
    ProcessEvent,
    ProcessExited as ProcessExited,
    ProcessIO as ProcessIO,
    ProcessStarted as ProcessStarted,
)
from actors.ros.launch.absent import absent

RunningProcessEvent = ProcessEvent
ProcessStdin = absent("ProcessStdin", "the stdin of processes is empty")
ProcessStdout = ProcessIO
ProcessStderr = ProcessIO
ShutdownProcess = absent("ShutdownProcess", "a launch stops its processes together, with Shutdown")
SignalProcess = absent("SignalProcess", "a launch stops its processes together, with Shutdown")
