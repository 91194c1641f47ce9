"""What tests read or set inside supervisors and launches, where no public name has it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from asyncio import TimerHandle

    from actors.launch.engine.runner import Runner
    from actors.launch.output.log_folder import LogFolder
    from actors.processes.guard import Guard
    from actors.processes.process import Process
    from actors.processes.supervisor import Supervisor


def guard_process(supervisor: Supervisor) -> Process | None:
    """Return the process of a supervisor's guard, which a test kills."""
    return supervisor._driver.guard._process


def close_guard_pipe(supervisor: Supervisor) -> None:
    """Close the pipe to a guard, as the system does when the supervisor is killed."""
    supervisor._driver.guard._close_pipe()


def tell_again(guard: Guard, pid: int) -> None:
    """Tell a guard of a process that it knows already."""
    guard._write(f"+ {pid}\n")


def lost_events(supervisor: Supervisor) -> int:
    """Return how many events of children could not be published."""
    return supervisor._publisher.lost


def child_process(execution: Any) -> Process:
    """Return the process of one run of a launched program, to wait for it where launch has given it up."""
    process: Process | None = execution._process
    assert process is not None
    return process


def timer_of(runner: Runner) -> TimerHandle | None:
    """Return the timer of a launch, which output must not move."""
    return runner._driver._timer


def open_files(folder: LogFolder) -> int:
    """Return how many log files are open."""
    return len(folder._files)
