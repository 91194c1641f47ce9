"""Settings of all tests: no broker of the developer is used, and processes start from bytecode."""

from __future__ import annotations

import atexit
import gc
import logging
import os
import signal
import sys
import tempfile
from typing import TYPE_CHECKING

import hypothesis
import pytest

if sys.dont_write_bytecode and sys.pycache_prefix is None:
    from tests.bytecode import cache_bytecode

    cache_bytecode()  # before the imports below, which are most of what a test imports

if "MEASURE_COVERAGE" in os.environ:
    from tests import measurement  # before all that it measures

from actors.config import environment
from actors.logging.logger import get_logger  # the import sets the log's level, which `_process` remembers
from actors.logging.severity import ROOT_NAME
from tests import real_ros

if TYPE_CHECKING:
    from collections.abc import Generator, Iterator

SHARED_MACHINE = hypothesis.settings(
    hypothesis.settings.get_profile("default"),
    deadline=None,
    suppress_health_check=[hypothesis.HealthCheck.too_slow],
)
# The same examples in each run: a test fails because of a change, not by chance. `make nightly` has others.
hypothesis.settings.register_profile("short", SHARED_MACHINE, max_examples=25, derandomize=True)
hypothesis.settings.register_profile("nightly", SHARED_MACHINE, max_examples=1000, print_blob=True)


@pytest.hookimpl(optionalhook=True)  # without pytest-xdist there is no such hook
def pytest_xdist_auto_num_workers(config: pytest.Config) -> int:
    """Return two workers for each core, because many tests wait for processes; "logical" is one for each."""
    cores = os.cpu_count() or 1
    return cores if config.option.numprocesses == "logical" else 2 * cores


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Deselect real ROS 2 where it is not; begin with long tests, which would keep one worker at the end."""
    if not real_ros.is_supported():
        folders = {config.rootpath / "tests" / name for name in real_ros.FOLDERS}
        without = [item for item in items if folders & {*item.path.parents}]
        config.hook.pytest_deselected(items=without)
        items[:] = [item for item in items if item not in without]
    items.sort(key=lambda item: item.get_closest_marker("long") is None)


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Say why the tests of real ROS 2 have not run."""
    if not real_ros.is_supported():
        names = " and ".join(f"tests/{name}" for name in real_ros.FOLDERS)
        terminalreporter.write_line(f"{names} are deselected: they need Linux x86-64 and CPython 3.11")


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Let the garbage collector ignore what is imported and collected.

    It is more than most tests make, stays until the end, and would be walked through again and again.
    """
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the option that `make nightly` sets."""
    parser.addoption("--nightly", action="store_true", help="more examples and histories: an hour, or more")


def pytest_configure(config: pytest.Config) -> None:
    """Load the profile; remove variables, contexts and logs of the developer, here and in child processes.

    SIGINT and SIGHUP work as in a terminal. A shell starts a job in the background with SIGINT ignored, nohup
    a program with SIGHUP ignored, and programs that tests start would inherit that.
    """
    for number, handler in ((signal.SIGINT, signal.default_int_handler), (signal.SIGHUP, signal.SIG_DFL)):
        if signal.getsignal(number) is signal.SIG_IGN:
            signal.signal(number, handler)
    if "MEASURE_COVERAGE" in os.environ:
        config.pluginmanager.register(measurement.MEASUREMENT)
    hypothesis.settings.load_profile("nightly" if config.getoption("--nightly") else "short")
    # The second would show packages of ROS 2 that are installed on this machine.
    for name in (*environment.CHOOSING_VARIABLES, "AMENT_PREFIX_PATH"):
        os.environ.pop(name, None)
    folder = tempfile.TemporaryDirectory(prefix="callboard-tests-")
    atexit.register(folder.cleanup)  # pytest's own hook for the end is not called in all workers
    os.environ.update(dict.fromkeys(("XDG_CONFIG_HOME", "XDG_STATE_HOME", "XDG_CACHE_HOME"), folder.name))


@pytest.fixture
def patience(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nodes of this process wait long for a broker, for tests that start one themselves."""
    # It imports most of callboard, which the process that starts the workers does not need.
    from tests.seams.limits import be_patient  # noqa: PLC0415

    be_patient(monkeypatch)


@pytest.fixture(autouse=True)
def _log_handlers() -> Iterator[None]:
    """No test leaves a log handler behind: it would write to a stream that later tests have not."""
    before = logging.root.handlers[:]
    yield
    left = [each for each in logging.root.handlers if each not in before]
    for each in left:
        logging.root.removeHandler(each)
    assert not left


@pytest.fixture(autouse=True)
def _process() -> Iterator[None]:
    """Undo what a command that runs in the tests' process changes for its rest: the log's level, finders.

    Loggers, too, are new: a line that is throttled would be left out after a test that has logged it as well.
    """
    get_logger.cache_clear()
    log, finders = logging.getLogger(ROOT_NAME), sys.meta_path
    level, before, trace = log.level, finders[:], sys.gettrace()
    yield
    log.setLevel(level)
    finders[:] = before
    assert sys.gettrace() is trace  # a debugger's
