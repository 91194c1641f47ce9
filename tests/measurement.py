"""Measure the branch coverage of the tests in this process: all that is imported after this module.

Instrumented code notes each of its lines and branches once. A trace function is called for the lines of all
libraries, too, and triples the CPU time of the tests.
"""

from __future__ import annotations

import ast
import os
import sys
import tomllib
from fnmatch import fnmatch
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import pytest
from slipcover import Slipcover, print_coverage
from slipcover.branch import preinstrument

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from types import CodeType

    _Places = dict[str, set[Any]]

ROOT = Path(__file__).parents[1]
REPORT = ROOT / "build" / "coverage.txt"
KEEP_INSTRUMENTED = -1
"""Replacing the code of functions walks through modules that other threads change, and fails by chance."""


CACHED: Final = f"-slipcover-{version('slipcover')}.pyc"
"""How names of files end that have the bytecode of measured modules, before probes are added."""


class _Loader(SourceFileLoader):
    def __init__(self, name: str, path: str, slipcover: Slipcover) -> None:
        super().__init__(name, path)
        self._slipcover = slipcover

    def get_code(self, fullname: str) -> CodeType:
        code: CodeType = self._slipcover.instrument(self.marked_code())
        return code

    def marked_code(self) -> CodeType:
        """Return the code with its branches marked, which takes most of the time and is cached."""
        code = super().get_code(self.name)
        assert code is not None
        return code

    def source_to_code(  # type: ignore[override] # the importer calls it like this
        self, data: Any, path: Any, *, _optimize: int = -1
    ) -> CodeType:
        # Otherwise the code would have the future statements of this module, too.
        return compile(preinstrument(ast.parse(data)), path, "exec", dont_inherit=True, optimize=_optimize)

    def get_data(self, path: str) -> bytes:
        return super().get_data(_cached(path))

    def set_data(self, path: str, data: Any, *, _mode: int = 0o666) -> None:
        super().set_data(_cached(path), data, _mode=_mode)


def _cached(path: str) -> str:
    """Return the path of a file that Python reads or writes: bytecode that is measured has its own."""
    return path.removesuffix(".pyc") + CACHED if path.endswith(".pyc") else path


class _Finder:
    """Comes before pytest's, which would load `actors`, because that contains a plugin."""

    def __init__(self, slipcover: Slipcover, packages: Sequence[str], omit: Sequence[str]) -> None:
        self._slipcover = slipcover
        self._packages = frozenset(packages)
        self._omit = [str(ROOT / pattern) for pattern in omit]

    def share_compilation(self, number: int, workers: int) -> None:
        """Cache the bytecode of all files that other workers have not cached, each from another one on.

        Otherwise workers that begin together on a clean checkout would each compile everything.
        """
        found = (
            path for package in sorted(self._packages) for path in sorted((ROOT / package).rglob("*.py"))
        )
        paths = [str(path) for path in found if self._is_measured(str(path))]
        begin = len(paths) * number // workers
        for path in (*paths[begin:], *paths[:begin]):
            _Loader("", path, self._slipcover).marked_code()

    def _is_measured(self, path: str) -> bool:
        return not any(fnmatch(path, pattern) for pattern in self._omit)

    def find_spec(self, name: str, folders: Sequence[str] | None, target: object = None) -> ModuleSpec | None:
        if name.partition(".")[0] not in self._packages:
            return None
        spec = PathFinder.find_spec(name, folders)
        if spec is not None and type(spec.loader) is SourceFileLoader:
            path = spec.loader.path
            if self._is_measured(path):
                spec.loader = _Loader(name, path, self._slipcover)
        return spec


def _places(slipcover: Slipcover, seen: _Places) -> tuple[_Places, _Places, _Places]:
    """Return what has run, and what could have: lines and branches, by files."""
    return seen, slipcover.code_lines, slipcover.code_branches


def _copy(places: _Places) -> _Places:
    """Return what can be walked through while a thread that a test has left still runs code."""
    return {path: places[path].copy() for path in tuple(places)}


class Measurement:
    """A plugin of pytest: a worker sends what it has run to the process that started it, which reports."""

    def __init__(self, settings: Mapping[str, Any]) -> None:
        self._settings = settings
        self._here = self._create()
        self._all = self._create()
        self._percent = 0.0
        finder = _Finder(self._here, settings["source"], settings["omit"])
        sys.meta_path.insert(0, finder)
        if "PYTEST_XDIST_WORKER" in os.environ:
            number = int(os.environ["PYTEST_XDIST_WORKER"].removeprefix("gw"))
            finder.share_compilation(number, int(os.environ["PYTEST_XDIST_WORKER_COUNT"]))

    def _create(self) -> Slipcover:
        options = {name: self._settings[name] for name in ("source", "omit", "exclude_also")}
        return Slipcover(branch=True, d_miss_threshold=KEEP_INSTRUMENTED, **options)

    def pytest_testnodedown(self, node: Any) -> None:
        """Add what a worker has run; one that has crashed sends nothing."""
        output = getattr(node, "workeroutput", {})
        if "measured" in output:
            self._add(*output["measured"])

    def _add(self, *measured: _Places) -> None:
        for ours, theirs in zip(_places(self._all, self._all.all_seen), measured, strict=True):
            for path, places in theirs.items():
                ours[path] |= places

    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        """Send what has run, or write the report and fail below the limit."""
        output = getattr(session.config, "workeroutput", None)
        if output is not None:
            output["measured"] = [_copy(each) for each in _places(self._here, self._here.newly_seen)]
            return
        self._add(*_places(self._here, self._here.newly_seen))
        coverage = self._all.get_coverage()
        self._percent = coverage["summary"]["percent_covered"]
        REPORT.parent.mkdir(exist_ok=True)
        with REPORT.open("w") as file:
            print_coverage(coverage, outfile=file, skip_covered=True)
        if self._percent < self._settings["fail_under"] and session.exitstatus == pytest.ExitCode.OK:
            session.exitstatus = pytest.ExitCode.TESTS_FAILED

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        """Print the figure, the limit, and where the lines are that did not run."""
        limit = self._settings["fail_under"]
        verdict = "as required" if self._percent >= limit else f"FAIL: {limit} % are required"
        where = REPORT.relative_to(ROOT)
        terminalreporter.write_line(f"Coverage: {self._percent:.2f} %, {verdict}. What did not run: {where}")


# The plugin for users' tests has come before, with what it imports, and keeps nothing of it.
for _name in [each for each in sys.modules if each.partition(".")[0] == "actors"]:
    del sys.modules[_name]
MEASUREMENT = Measurement(tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["slipcover"])
