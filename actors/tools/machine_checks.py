"""Checks of this machine: Python, callboard's dependencies, import names, limits and settings."""

from __future__ import annotations

import os
import platform
import re
import sys
from difflib import get_close_matches
from importlib import import_module
from importlib.metadata import distributions, version
from pathlib import Path
from typing import TYPE_CHECKING, Final

from actors.config import environment
from actors.config.contexts import Contexts, contexts_file
from actors.tools.check import Check
from proto.errors import CallboardError
from proto.wire.identity import VERSION
from proto.wire.url import parse_urls

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping
    from types import ModuleType

OLDEST_PYTHON: Final = (3, 11)
PACKAGES: Final = ("proto", "broker", "actors", "callboard")
"""Callboard's import names."""
_PACKAGE_FILE: Final = re.compile(rf"^({'|'.join(PACKAGES)})(?:/|\.py\b)", re.MULTILINE)
"""A path in a distribution's list of files that begins with such a name."""
FEW_FILES: Final = 1024
"""Below this limit a warning: a broker needs an open file for each connection."""


def all_checks() -> list[Check]:
    """Return the results of all checks of this machine."""
    return [
        python(),
        event_loop(),
        codec(),
        *import_names(),
        *shadows(Path.cwd()),
        open_files(),
        *variables(),
        *contexts(),
    ]


def python(number: tuple[int, ...] = sys.version_info[:3]) -> Check:
    """Return the check of the interpreter.

    Args:
        number: Its version.
    """
    finding = f"{platform.python_implementation()} {'.'.join(map(str, number))}, callboard {VERSION}"
    if number < OLDEST_PYTHON:
        return Check("python", "fail", finding, "install Python 3.11 or later")
    return Check("python", "ok", finding)


def event_loop(*, platform_name: str = sys.platform) -> Check:
    """Return the check for uvloop, which scripts and the daemon use if it is installed.

    Args:
        platform_name: As `sys.platform` has it.
    """
    try:
        uvloop = import_module("uvloop")
    except ImportError:
        if platform_name == "win32" or platform.python_implementation() != "CPython":
            return Check("event loop", "ok", "asyncio; there is no uvloop for this platform")
        return Check(
            "event loop", "warn", "asyncio: uvloop is not installed", "pip install uvloop: it is faster"
        )
    return Check("event loop", "ok", f"uvloop {uvloop.__version__}")


def codec() -> Check:
    """Return the check of the codecs: msgpack with its C extension, and msgspec."""
    import msgpack  # noqa: PLC0415 - the subject of the check

    try:
        import_module("msgspec")
    except ImportError as error:
        remedy = "pip install --force-reinstall msgspec"
        return Check("codec", "fail", f"msgspec cannot be imported: {error}", remedy)
    finding = f"msgpack {version('msgpack')}, msgspec {version('msgspec')}"
    if msgpack.Packer.__module__ == "msgpack.fallback":
        remedy = "unset MSGPACK_PUREPYTHON, or: pip install --force-reinstall --only-binary :all: msgpack"
        return Check(
            "codec", "warn", f"{finding}; msgpack runs without its C extension, which is slow", remedy
        )
    return Check("codec", "ok", finding)


def import_names(claims: Mapping[str, Collection[str]] | None = None) -> list[Check]:
    """Return the check that callboard's import names belong to callboard alone.

    Args:
        claims: The distributions that provide each import name; None for the installed ones.
    """
    owners = _owners() if claims is None else claims
    home = _folder(import_module("actors")).parent
    found: list[Check] = []
    for name in PACKAGES:
        folder = _folder(import_module(name))
        others = sorted(set(owners.get(name, ())) - {"callboard"})
        if folder.parent != home:
            remedy = "keep the two in separate environments, or rename what is your own"
            found.append(Check("import names", "fail", f"'{name}' is {folder}, not callboard's", remedy))
        elif others:
            text = f"'{name}' also belongs to {', '.join(others)}: each overwrites files of the other"
            remedy = f"keep callboard and {others[0]} in separate environments: python -m venv"
            found.append(Check("import names", "fail", text, remedy))
    return found or [
        Check("import names", "ok", f"proto, broker, actors and callboard are callboard's, in {home}")
    ]


def _owners() -> dict[str, set[str]]:
    """Return the installed distributions with files of each package.

    `packages_distributions` makes a path of each file of each distribution, which takes four times as long.
    """
    owners: dict[str, set[str]] = {name: set() for name in PACKAGES}
    for each in distributions():
        files = each.read_text("RECORD") or each.read_text("installed-files.txt") or ""
        declared = (each.read_text("top_level.txt") or "").split()
        for name in {*_PACKAGE_FILE.findall(files), *(owners.keys() & declared)}:
            owners[name].add(each.name)
    return owners


def _folder(module: ModuleType) -> Path:
    return Path(next(iter(module.__path__))).resolve()


def shadows(folder: Path) -> list[Check]:
    """Return warnings about files in a folder that hide callboard from the scripts in it.

    Args:
        folder: Where scripts are run.
    """
    if (folder / "actors/cli/main.py").is_file():  # a clone of callboard
        return []
    hiding = [
        name
        for package in PACKAGES
        for name in (f"{package}.py", f"{package}/__init__.py")
        if (folder / name).is_file()
    ]
    found: list[Check] = []
    for name in hiding:
        hidden = name.partition("/")[0].removesuffix(".py")
        text = f"{folder / name} hides callboard's '{hidden}' from scripts beside it"
        found.append(Check("import names", "warn", text, "rename it"))
    return found


def open_files() -> Check:
    """Return the check of the limit of open files."""
    try:
        import resource  # noqa: PLC0415 - not on Windows
    except ImportError:
        return Check("open files", "skip", "this platform has no such limit")
    return judged_files(*resource.getrlimit(resource.RLIMIT_NOFILE))


def judged_files(soft: int, hard: int) -> Check:
    """Return the check of a limit of open files; a broker raises its soft limit to the hard one.

    Args:
        soft: The soft limit; negative for none.
        hard: The hard limit; negative for none.
    """
    finding = f"{_limit(soft)} for a process, {_limit(hard)} for a broker"
    if 0 <= hard <= FEW_FILES:
        remedy = "raise the hard limit where brokers run: ulimit -Hn, LimitNOFILE= or limits.conf"
        return Check("open files", "warn", f"{finding}, one for each connection", remedy)
    return Check("open files", "ok", finding)


def _limit(number: int) -> str:
    return "no limit" if number < 0 else str(number)


def variables(environ: Mapping[str, str] | None = None) -> list[Check]:
    """Return the checks of the environment variables that begin with CALLBOARD_.

    Args:
        environ: The variables; None for those of the process.
    """
    found: list[Check] = []
    given = environment.own_variables(environ)
    for name in sorted(given):
        if name not in environment.VARIABLES:
            close = get_close_matches(name, environment.VARIABLES, n=1)
            remedy = f"did you mean {close[0]}?" if close else f"there is {', '.join(environment.VARIABLES)}"
            found.append(Check("variables", "warn", f"{name} is set, and means nothing to callboard", remedy))
    try:
        parse_urls(environment.broker_url(environ) or "callboard://any")
    except CallboardError as error:
        found.append(Check("variables", "fail", f"CALLBOARD_URL: {error}", "correct it, or unset it"))
    for read in (environment.domain_id, environment.log_level):
        try:
            read(environ)
        except CallboardError as error:
            found.append(Check("variables", "fail", str(error), "correct it, or unset it"))
    warning = environment.ignored_ros_domain(0, environ)
    if warning is not None:
        finding, _, remedy = warning.partition(": ")
        found.append(Check("variables", "warn", finding, remedy))
    return found or [
        Check("variables", "ok", ", ".join(sorted(given)) or "none of callboard's variables is set")
    ]


def contexts() -> list[Check]:
    """Return the check of the file of named brokers."""
    path = Path(contexts_file())
    try:
        known = Contexts.load()
        for name, source in ((known.current, str(path)), (environment.context_name(), "CALLBOARD_CONTEXT")):
            if name is not None:
                known.get(name, source)
    except CallboardError as error:
        return [Check("contexts", "fail", str(error), "correct it, or: callboard context use default")]
    if not path.exists():
        return [Check("contexts", "ok", "no named contexts")]
    if os.name == "posix" and path.stat().st_mode & 0o077:
        return [Check("contexts", "warn", f"others can read or write {path}", f"chmod 600 {path}")]
    return [Check("contexts", "ok", f"{len(known.named)} named; '{known.current}' is in use")]
