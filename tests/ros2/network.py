"""A ROS domain, a broker and a bridge between them, as processes."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from typing import TYPE_CHECKING, Final

from tests.fork_server.client import forked
from tests.ports import hold_port
from tests.real_ros import REAL_PYTHON, ROOT
from tests.real_ros.sides import FOREIGN, Domain, SideError
from tests.ros2.ros import Ros

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

STOP_TIMEOUT_SEC: Final = 40.0
DEFAULT_LEASE_SEC: Final = 20
"""Fast DDS's own."""
PROFILE: Final = """<profiles xmlns="http://www.eprosima.com"><participant profile_name="lease" \
is_default_profile="true"><rtps><builtin><discovery_config><leaseDuration><sec>{0}</sec></leaseDuration>\
<leaseAnnouncement><sec>1</sec></leaseAnnouncement></discovery_config></builtin></rtps></participant>\
<data_writer profile_name="patient" is_default_profile="true"><qos><reliability><kind>RELIABLE</kind>\
<max_blocking_time><sec>20</sec></max_blocking_time></reliability></qos></data_writer></profiles>
"""
"""A profile of Fast DDS for the processes of ROS. A service that has a request, but does not know yet where
the response is read, drops it after the time for which a writer may block: 0.1 s by default, which is not
enough on a busy machine, and leaves the caller without a word."""


class Process:
    """A process whose output goes to a file.

    Args:
        command: The program and its arguments.
        environ: Its variables.
        output: The file.
    """

    def __init__(self, command: tuple[str, ...], environ: Mapping[str, str], output: Path) -> None:
        self._output = output
        self._read = output.stat().st_size if output.exists() else 0
        with output.open("ab") as file:
            self._process = subprocess.Popen(
                command,
                executable=forked(command[0]),
                cwd=ROOT,
                env=environ,
                stdin=subprocess.DEVNULL,
                stdout=file,
                stderr=file,
            )

    @property
    def pid(self) -> int:
        """The process id."""
        return self._process.pid

    @property
    def is_alive(self) -> bool:
        """Whether it runs."""
        return self._process.poll() is None

    def output(self) -> str:
        """Return what it has written since its start, or since the last call."""
        with self._output.open("rb") as file:
            file.seek(self._read)
            found = file.read()
        self._read += len(found)
        return found.decode(errors="replace")

    def send_signal(self, number: signal.Signals) -> None:
        """Send a signal."""
        self._process.send_signal(number)

    def wait(self) -> int:
        """Wait for its end; return its exit code.

        Raises:
            subprocess.TimeoutExpired: It has not ended in time.
        """
        return self._process.wait(STOP_TIMEOUT_SEC)

    def stop(self) -> int:
        """End it by SIGINT, and by SIGKILL if it does not end; return its exit code."""
        if self.is_alive:
            self._process.send_signal(signal.SIGINT)
        try:
            return self.wait()
        except subprocess.TimeoutExpired:
            return self.kill()

    def kill(self) -> int:
        """Kill it; return its exit code."""
        self._process.kill()
        return self._process.wait()


class Network:
    """A ROS domain of its own, a port for a broker, and what runs there.

    Args:
        folder: For logs.
        first: The domain to try first.

    Attributes:
        domain: The number of the domain.
        url: The URL of the broker.
        environ: Variables for processes of ROS 2.
    """

    def __init__(self, folder: Path, first: int = 0) -> None:
        if not REAL_PYTHON.exists():
            raise SideError(f"{REAL_PYTHON} does not exist: run `make test`, which builds it")
        self._folder = folder
        self._domain = Domain(first)
        self._port = hold_port()
        self._processes: list[Process] = []
        self._ros: list[Ros] = []
        self.domain = self._domain.number
        self.url = f"callboard://127.0.0.1:{self._port.getsockname()[1]}"
        self.environ = {
            "ROS_DOMAIN_ID": str(self.domain),
            "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
            "ROS_LOG_DIR": str(folder),
        }

    def broker(self, *args: str) -> Process:
        """Start a broker, which need not listen yet."""
        port = self.url.rpartition(":")[2]
        return self.process("broker", sys.executable, "-m", "broker", "--port", port, *args)

    def bridge(self, *args: str, domain: int | None = None, url: str = "") -> Process:
        """Start a bridge.

        Args:
            *args: More arguments.
            domain: Another ROS domain than this one.
            url: Another broker.
        """
        number = self.domain if domain is None else domain
        command = ("-m", "actors", "bridge", "ros2", "--domain-id", str(number), "--url", url or self.url)
        return self.process("bridge", str(REAL_PYTHON), *command, *args)

    def process(self, name: str, *command: str, **variables: str) -> Process:
        """Start a process with the variables of this network."""
        own = {name: value for name, value in os.environ.items() if not name.startswith(FOREIGN)}
        environ = {**own, **self.environ, "PYTHONPATH": str(ROOT), "PYTHONUNBUFFERED": "1", "NO_COLOR": "1"}
        environ |= {"CALLBOARD_URL": self.url, "CALLBOARD_DOMAIN": "0", **variables}
        made = Process(command, environ, self._folder / f"{name}.log")
        self._processes.append(made)
        return made

    def callboard(self, *args: str) -> Process:
        """Start a command of callboard."""
        return self.process(f"command-{len(self._processes)}", sys.executable, "-m", "actors", *args)

    def ros(self, *, lease_sec: int = DEFAULT_LEASE_SEC) -> Ros:
        """Return a process of real ROS 2, which starts when it is first asked.

        Args:
            lease_sec: How long ROS shows it after its death.
        """
        profile = self._folder / f"profile_{lease_sec}.xml"
        profile.write_text(PROFILE.format(lease_sec), encoding="utf-8")
        made = Ros({**self.environ, "FASTDDS_DEFAULT_PROFILES_FILE": str(profile)})
        self._ros.append(made)
        return made

    def close(self) -> None:
        """End all processes, the latest first."""
        for each in self._ros:
            each.close()
        for process in reversed(self._processes):
            process.stop()
        self._port.close()
        self._domain.close()
