"""The two sides, one process each for all tests of a pytest worker; how many cases agreed, by kind."""

from __future__ import annotations

import os
import subprocess
import sys
from typing import TYPE_CHECKING

import pytest

from tests.fork_server.client import FORKED
from tests.real_ros import ROOT
from tests.real_ros.differences import counts
from tests.real_ros.sides import FACE_COMMAND, REAL_COMMAND, Domain, Side

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path


@pytest.fixture(scope="session")
def real_environ(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, str]]:
    """Variables for processes of real ROS 2: a domain for this worker, no traffic beyond this machine."""
    logs: Path = tmp_path_factory.mktemp("ros-log")
    domain = Domain(int(os.environ.get("PYTEST_XDIST_WORKER", "gw0").removeprefix("gw")))
    yield {
        "ROS_DOMAIN_ID": str(domain.number),
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        "ROS_LOG_DIR": str(logs),
    }
    domain.close()


@pytest.fixture(scope="session")
def real(real_environ: dict[str, str]) -> Iterator[Side]:
    """Real ROS 2. It can import callboard's `actors` too, for bridges."""
    side = Side(REAL_COMMAND, real_environ)
    yield side
    side.close()


@pytest.fixture(scope="session")
def face_url() -> Iterator[str]:
    """The URL of a broker for callboard's ROS face.

    The broker is a process, too: as long as a thread ran one here, simulated histories of this worker counted
    what its channels did.
    """
    command = (sys.executable, "-m", "broker", "--port", "0")
    with subprocess.Popen(command, executable=FORKED, cwd=ROOT, stdout=subprocess.PIPE, text=True) as broker:
        assert broker.stdout is not None
        try:
            yield broker.stdout.readline().split()[-1]
        finally:
            broker.terminate()  # `with` waits for its end


@pytest.fixture(scope="session")
def face(face_url: str) -> Iterator[Side]:
    """callboard's ROS face."""
    environ = {"CALLBOARD_URL": face_url, "PYTHONPATH": str(ROOT / "tests" / "interfaces")}  # for test_msgs
    side = Side(FACE_COMMAND, environ)
    yield side
    side.close()


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Print how many cases agreed; with pytest-xdist the workers have counted, and nothing is printed."""
    for kind, (equal, listed) in sorted(counts().items()):
        terminalreporter.write_line(f"real ROS 2: {kind}: {equal} equal, {listed} listed as different")
