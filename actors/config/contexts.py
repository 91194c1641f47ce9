"""Named brokers, and the choice of the broker to use.

    with Contexts.changing() as contexts:
        contexts.add("robot", Context(url="callboard://robot:7411", domain=3))
        contexts.use("robot")
    find_broker_target()  # the broker that nodes and commands use now

They are stored in `callboard/contexts.toml` in the XDG configuration directory, readable by its owner only.

The first of these that is set decides: the caller's URL and domain (`--url`, `--domain`), the caller's
context (`--context`), CALLBOARD_URL and CALLBOARD_DOMAIN, the context named by CALLBOARD_CONTEXT, the one in
use, the default. A context that the environment or the file selects is ignored if a URL is given: its domain
belongs to its broker.
"""

# Every command and node imports this: pathlib would cost some milliseconds.
# ruff: noqa: PTH103, PTH105, PTH117, PTH118, PTH120, PTH123
from __future__ import annotations

import os
import re
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final, NamedTuple, TypeVar, cast

from actors.config import environment
from actors.config.context_errors import ContextError, UnknownContextError
from actors.config.credentials import Credentials, find_credentials
from actors.regular_files import read_regular
from proto.errors import CallboardError
from proto.limits import MAX_DOMAIN
from proto.untrusted_text import escape
from proto.wire.tls import TlsFiles
from proto.wire.url import DEFAULT_URL, parse_urls

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Iterable
    from typing import Self

    from proto.wire.url import BrokerUrl

DEFAULT: Final = "default"
"""The context that always exists: the default URL, without a domain."""

T = TypeVar("T")

MAX_CONTEXTS: Final = 1000
MAX_FILE_BYTES: Final = 1024 * 1024
_NAME: Final = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,63}")
_FILES: Final = ("token_file", "ca", "cert", "key")
_KEYS: Final = {"url": str, "domain": int, "description": str, **dict.fromkeys(_FILES, str)}
_warned: Final = set[str]()
"""The warnings that this process has given; one, unless its environment changes."""
_HEADER: Final = "# Written by `callboard context`, which keeps no comments.\n"


@dataclass(frozen=True, kw_only=True, slots=True)
class Context:
    """One named broker.

    Attributes:
        url: Its URL, or several with commas.
        domain: The domain id, 0 to 232; None for CALLBOARD_DOMAIN.
        description: One line of text.
        token_file: A file with the token that it requires; "" for none.
        ca: A PEM file with the authorities to trust for TLS; "" for none of its own.
        cert, key: PEM files with the client's certificate and its private key; "" for none.
    """

    url: str = DEFAULT_URL
    domain: int | None = None
    description: str = ""
    token_file: str = ""
    ca: str = ""
    cert: str = ""
    key: str = ""

    @property
    def tls(self) -> TlsFiles:
        """Its files for TLS."""
        return TlsFiles(self.ca, self.cert, self.key)


class BrokerTarget(NamedTuple):
    """The broker and domain to use.

    Attributes:
        urls: The broker's URLs, in the order in which to try them.
        domain: The domain id.
        url_from: The source of the URL: "--url", "CALLBOARD_URL", "context 'robot'" or "default".
        domain_from: The source of the domain, in the same words.
        credentials: The credentials for the broker.
    """

    urls: tuple[BrokerUrl, ...]
    domain: int
    url_from: str
    domain_from: str
    credentials: Credentials = Credentials()

    @property
    def url(self) -> str:
        """The URLs in one string, separated by commas."""
        return ",".join(map(str, self.urls))


def contexts_file() -> str:
    """Return the path of the file of contexts, which may not exist."""
    return os.path.join(environment.config_folder(), "contexts.toml")


@dataclass(slots=True)
class Contexts:
    """The named brokers, and the one in use. Changes are stored by `changing` or `save`.

    Attributes:
        named: The contexts by name, without the default.
        current: The name of the one in use.
    """

    named: dict[str, Context] = field(default_factory=dict[str, Context])
    current: str = DEFAULT

    @classmethod
    @contextmanager
    def changing(cls) -> Generator[Self]:
        """Read the file, and write it on exit unless an exception is raised, under a lock.

        Raises:
            ContextError: The file is broken or cannot be written, or it was locked for 5 s.
        """
        with _locked(contexts_file()):
            contexts = cls.load()
            yield contexts
            contexts.save()

    @classmethod
    def load(cls) -> Self:
        """Return the contexts of the file; without a file there is only the default.

        Raises:
            ContextError: The file is broken; the text names it, and the line or the key.
        """
        file = contexts_file()
        try:
            content = read_regular(file, MAX_FILE_BYTES + 1)
        except FileNotFoundError:
            return cls()
        except OSError as error:
            raise ContextError(f"Cannot read {file}: {error.strerror}") from error
        if len(content) > MAX_FILE_BYTES:
            raise ContextError(f"{file} is longer than {MAX_FILE_BYTES} bytes")
        try:
            return cls(*_read(content))
        except (ValueError, RecursionError) as error:
            raise ContextError(f"{file}: {escape(str(error))}") from error

    def save(self) -> None:
        """Write the file atomically, readable by its owner only.

        Raises:
            ContextError: It cannot be written.
        """
        file = contexts_file()
        # Written beside and renamed, so that a reader, which takes no lock, finds the old or the new file.
        new = f"{file}.{os.getpid()}.new"
        try:
            os.makedirs(os.path.dirname(file), mode=0o700, exist_ok=True)
            with open(os.open(new, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600), "wb") as stream:
                stream.write(self._text().encode())
            os.replace(new, file)
        except OSError as error:
            raise ContextError(f"Cannot write {file}: {error.strerror}") from error

    def names(self) -> tuple[str, ...]:
        """Return all names, the default first."""
        return (DEFAULT, *sorted(self.named))

    def get(self, name: str, source: str = "") -> Context:
        """Return a context.

        Args:
            name: Its name.
            source: Where the name comes from, for the error text.

        Raises:
            UnknownContextError: There is no such context.
        """
        if name == DEFAULT:
            return Context(description="callboard's default")
        if name not in self.named:
            raise UnknownContextError(name, self.names(), source)
        return self.named[name]

    def add(self, name: str, context: Context, *, replace: bool = False) -> None:
        """Add a context.

        Args:
            name: Its name.
            context: The broker.
            replace: Replace an existing context of that name.

        Raises:
            ContextError: The name exists or is invalid, or there are too many contexts.
            InvalidUrlError: The URL cannot be read.
        """
        _check_name(name)
        if name in self.named and not replace:
            raise ContextError(f"There is a context '{name}' already")
        if name not in self.named and len(self.named) >= MAX_CONTEXTS:
            raise ContextError(f"There are {MAX_CONTEXTS} contexts: remove one")
        self.named[name] = _checked(context)

    def remove(self, name: str) -> None:
        """Remove a context; if it is in use, the default becomes current.

        Args:
            name: Its name.

        Raises:
            ContextError: There is no such context, or it is the default.
        """
        if name == DEFAULT:
            raise ContextError(f"The context '{DEFAULT}' is always there")
        self.get(name)
        del self.named[name]
        if self.current == name:
            self.current = DEFAULT

    def use(self, name: str) -> None:
        """Make a context the current one.

        Args:
            name: Its name.

        Raises:
            UnknownContextError: There is no such context.
        """
        self.get(name)
        self.current = name

    def _text(self) -> str:
        lines = [_HEADER, f"current = {_quoted(self.current)}\n"]
        for name, context in sorted(self.named.items()):
            lines.append(f"\n[contexts.{name}]\nurl = {_quoted(context.url)}\n")
            if context.domain is not None:
                lines.append(f"domain = {context.domain}\n")
            texts = {key: getattr(context, key) for key in ("description", *_FILES)}
            lines += [f"{key} = {_quoted(text)}\n" for key, text in texts.items() if text]
        return "".join(lines)


@contextmanager
def _locked(file: str) -> Generator[None]:
    from proto.aio.file_lock import hold_lock  # noqa: PLC0415 - only for changes

    with ExitStack() as stack:
        try:
            stack.enter_context(hold_lock(file))
        except OSError as error:
            raise ContextError(f"Cannot write {file}: {error.strerror or error}") from error
        yield


def find_broker_target(
    url: str | None = None, domain: int | None = None, context: str | None = None
) -> BrokerTarget:
    """Return the broker to use. The file of contexts is read only if a context may decide.

    Args:
        url: The caller's URL; None to choose one, as the module describes.
        domain: The caller's domain id; None as above.
        context: The name of the caller's context; None as above.

    Raises:
        InvalidUrlError: The chosen URL is invalid.
        InvalidEnvironmentError: CALLBOARD_DOMAIN is invalid.
        ContextError: The context does not exist, or the file is broken.
    """
    variable = environment.broker_url()
    name, chosen = context, Contexts.load().get(context) if context is not None else None
    if url is None and chosen is None and variable is None:
        name, chosen = _ambient()
    source = DEFAULT if name == DEFAULT else f"context '{name}'"
    text, url_from = _first(
        ((url, "--url"), (chosen.url if chosen else None, source), (variable, "CALLBOARD_URL")),
        otherwise=DEFAULT_URL,
    )
    own = (chosen.domain if chosen else None, source)
    # A context named by the caller goes before the environment, one that is only in use goes after it.
    general = (environment.domain_id(), "CALLBOARD_DOMAIN")
    further = (general, own) if context is None else (own, general)
    graph, domain_from = _first(((domain, "--domain"), *further), otherwise=0)
    files = chosen if chosen is not None and url_from == source else Context()  # never to another broker
    credentials = find_credentials(files.token_file, files.tls, named=context is not None)
    return BrokerTarget(parse_urls(text), graph, url_from, domain_from, credentials)


def warn_of_ros_domain(target: BrokerTarget, warn: Callable[[str], object]) -> None:
    """Warn if ROS_DOMAIN_ID is set and not used, once in a process.

    Args:
        target: What the process uses. If anything has chosen its domain, that is meant.
        warn: Called with the text.
    """
    text = environment.ignored_ros_domain(target.domain) if target.domain_from == DEFAULT else None
    if text is not None and text not in _warned:
        _warned.add(text)
        warn(text)


def _first(values: Iterable[tuple[T | None, str]], *, otherwise: T) -> tuple[T, str]:
    """Return the first value that is set, with its source."""
    for value, source in values:
        if value is not None:
            return value, source
    return otherwise, DEFAULT


def _ambient() -> tuple[str, Context]:
    """Return the context that the environment or the file selects."""
    name = environment.context_name()
    if name == DEFAULT:
        return DEFAULT, Context()
    contexts = Contexts.load()
    if name is None:
        return contexts.current, contexts.get(contexts.current, f"in use in {contexts_file()}")
    return name, contexts.get(name, "CALLBOARD_CONTEXT")


def _check_name(name: str) -> None:
    if not _NAME.fullmatch(name):
        raise ContextError(
            f"A context cannot be called '{escape(name)}': use at most 64 letters, digits, - and _"
        )
    if name == DEFAULT:
        raise ContextError(f"The context '{DEFAULT}' is callboard's own: take another name")


def _checked(context: Context) -> Context:
    parse_urls(context.url)
    if context.domain is not None and not 0 <= context.domain <= MAX_DOMAIN:
        raise ContextError(f"domain must be an integer from 0 to {MAX_DOMAIN}, not {context.domain}")
    if not context.description.isprintable():
        raise ContextError("description must be one line of printable text")
    for key in _FILES:
        path = getattr(context, key)
        if path and not (path.isprintable() and os.path.isabs(path)):
            raise ContextError(f"{key} must be an absolute path")
    if bool(context.cert) != bool(context.key):
        raise ContextError("cert and key belong together: give both")
    return context


def _quoted(text: str) -> str:
    """Return a string without control characters as a TOML string."""
    import json  # noqa: PLC0415 - nodes only read

    return json.dumps(text, ensure_ascii=False)


def _read(content: bytes) -> tuple[dict[str, Context], str]:
    """Return the contexts in a file, and the name of the one in use.

    Raises:
        ValueError: The file is broken; the text says where.
    """
    import tomllib  # noqa: PLC0415 - most users have no such file

    data: dict[str, Any] = tomllib.loads(content.decode())
    _check_keys(data, {"current": str, "contexts": dict}, "")
    named: dict[str, Context] = {}
    entries: dict[str, Any] = data.get("contexts", {})
    for name, entry in entries.items():
        _check_name(name)
        where = f"contexts.{name}"
        if not isinstance(entry, dict) or "url" not in entry:
            raise ContextError(f"{where} needs a url")
        fields = cast("dict[str, Any]", entry)
        _check_keys(fields, _KEYS, f"{where}.")
        try:
            named[name] = _checked(Context(**fields))
        except CallboardError as error:
            raise ContextError(f"{where}: {error}") from error
    return named, data.get("current") or DEFAULT


def _check_keys(table: dict[str, Any], kinds: dict[str, type], where: str) -> None:
    for key, value in table.items():
        if key not in kinds:
            raise ContextError(f"no key '{where}{key}' is known; there is {', '.join(kinds)}")
        if type(value) is not kinds[key]:
            raise ContextError(f"{where}{key} must be of type {kinds[key].__name__}")
