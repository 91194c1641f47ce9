"""Queries of a broker without a node and without an event loop, answered within milliseconds.

    with Inspector("callboard://127.0.0.1:7411") as inspector:
        print(inspector.graph().nodes())

An inspector declares nothing, so it is not in the graph. It uses the same protocol as a node's link over a
blocking socket, one query at a time: the command line's queries need no more, and an inspector is ready in a
third of the time that importing a node takes.
"""

from __future__ import annotations

import os
import socket
import time
from contextlib import suppress
from typing import TYPE_CHECKING, Any, Final, TypeVar, cast

from actors.config.credentials import find_credentials, refused_credentials
from actors.errors import BrokerUnreachable
from actors.graph.broker_report import BrokerReport, ReportParts
from actors.graph.snapshot import GraphSnapshot
from actors.session.tls import tls_failure, tls_required
from proto import limits
from proto.aio.arena import host_identity
from proto.aio.tls import client_context, is_tls_error
from proto.checks import require_domain
from proto.errors import ErrorCode, ProtocolError
from proto.untrusted_text import peer_text
from proto.wire import frames
from proto.wire.codec import Decoder, encode
from proto.wire.fragments import Reassembler
from proto.wire.identity import agent
from proto.wire.receiver import SCRATCH_BYTES, Receiver
from proto.wire.session import Role, Session, State
from proto.wire.url import parse_urls

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from typing import Self

    from actors.config.contexts import BrokerTarget
    from actors.config.credentials import Credentials
    from proto.wire.frames import Frame
    from proto.wire.tls import TlsFiles
    from proto.wire.url import BrokerUrl


AGENT: Final = agent("callboard-inspector")
_QUERY: Final = 1
"""The id of each query: there is one at a time."""
MAX_ANSWER_BYTES: Final = 64 * 1024 * 1024
"""Bytes received for one query: enough for a graph of 200,000 endpoints."""

_STAY_SEC: Final = 3600.0
"""How long `stay_connected` waits before it starts the same wait again: a wait needs a deadline."""

FrameT = TypeVar("FrameT", bound="Frame")


class Inspector:
    """A blocking client for queries of one broker. Enter it to connect.

    Args:
        url: The broker: one URL, or several separated by commas, tried in order.
        domain: Which of the broker's graphs, 0 to 232.
        credentials: Credentials for the broker; None for those that the environment names.
        timeout_sec: How long connecting may take, and each complete answer, in seconds. Each URL has an equal
            share of the time that is left for connecting.

    Raises:
        InvalidUrlError: The URL cannot be read.
        ValueError: The domain is not from 0 to 232.
        TypeError: The domain is not an int.
        InvalidEnvironmentError: CALLBOARD_INSECURE is invalid.

    Entering and every query raise BrokerUnreachable if no broker answers in time, and ProtocolError if the
    broker refuses (NotAuthorized: it requires other credentials), violates the protocol, or sends more than
    64 MiB for one query.

    A query without a complete answer ends the connection, since a late answer would be taken for the next
    query's: make another inspector.

    Attributes:
        urls: The brokers to try.
        url: The one it is connected to.
        listening: The first URL where something accepted the connection without a greeting, so that no broker
            can be started there; None if there was none.
        error: Why it has not reached the first of `urls`; None if it has, or has not tried.
        welcome: The options of the broker's greeting: agent, broker, keepalive_ms, max_message_bytes, …
        certificate: The broker's certificate, as `ssl.SSLSocket.getpeercert` shows it; empty without TLS.
        round_trip_sec: How long the broker took to answer the greeting.
        clock_ahead_sec: By how many seconds the broker's wall clock is ahead of this machine's, with an error
            of up to half a round trip; None if the broker does not report it.
    """

    def __init__(
        self,
        url: str,
        *,
        domain: int = 0,
        credentials: Credentials | None = None,
        timeout_sec: float = 2.0,
    ) -> None:
        require_domain(domain)
        self.urls = parse_urls(url)
        self.url = self.urls[0]
        self.listening: BrokerUrl | None = None
        self.error: OSError | None = None
        self.welcome: frames.Options = {}
        self.certificate: Mapping[str, Any] = {}
        self.round_trip_sec = 0.0
        self.clock_ahead_sec: float | None = None
        self._domain = domain
        self._credentials = credentials or find_credentials()
        self._timeout_sec = timeout_sec
        self._socket: socket.socket | None = None
        # One buffer for all attempts: each URL that is tried begins a session of its own.
        self._scratch = memoryview(bytearray(SCRATCH_BYTES))
        self._start_session()

    def __enter__(self) -> Self:
        """Connect, if `connect` has not been called.

        Raises:
            BrokerUnreachable: None answered within `timeout_sec`.
            ProtocolError: The broker refuses, or violates the protocol.
        """
        if self._socket is None:
            self.connect()
        return self

    def connect(self) -> None:
        """Connect to the first broker that answers.

        Raises:
            BrokerUnreachable: None answered within `timeout_sec`; TlsFailed because of TLS.
            ProtocolError: The broker refuses, or violates the protocol.
            TlsFileError: A file for TLS cannot be used.
        """
        deadline = time.monotonic() + self._timeout_sec
        unwelcoming: BrokerUnreachable | None = None
        for left, url in zip(range(len(self.urls), 0, -1), self.urls, strict=True):
            now = time.monotonic()
            try:
                # A share of the rest for each, so that a first broker that accepts and says nothing leaves
                # time for the others.
                self._greet(url, now + (deadline - now) / left)
            except OSError as error:
                if url == self.urls[0]:
                    self.error = error
                # Something has accepted the connection. That is a better explanation than "no broker" of
                # those that refused it.
                if self._socket is not None and unwelcoming is None:
                    self.listening, unwelcoming = url, _unwelcoming(url, error, self._credentials.tls)
                self._disconnect()
            # ProtocolError, for example: this is a broker, and it refuses. The next one is not asked.
            except BaseException:
                self._disconnect()
                raise
            else:
                self.url = url
                return
        if unwelcoming is not None:
            raise unwelcoming
        raise BrokerUnreachable(f"No broker at {', '.join(map(str, self.urls))}")

    def __exit__(self, *error: object) -> None:
        """Close."""
        self.close()

    def close(self) -> None:
        """Send GOODBYE and close the connection. A second call does nothing."""
        if self._session.is_open and self._socket is not None:
            with suppress(OSError):  # the broker has closed it first
                self._send(frames.Goodbye("done"))
        self._disconnect()

    def stay_connected(self) -> None:
        """Answer the broker's PINGs until the connection ends; this blocks, and no query can be made.

        A broker with `--exit-when-idle` does not end meanwhile.
        """
        with suppress(OSError, ProtocolError):
            while self._socket is not None:
                with suppress(TimeoutError):
                    self._answer_bytes = 0
                    self._next(frames.Welcome, time.monotonic() + _STAY_SEC)  # none comes; PINGs are answered
        self._disconnect()

    def _disconnect(self) -> None:
        if self._socket is not None:
            self._socket.close()
            self._socket = None

    # Queries

    def graph(self) -> GraphSnapshot:
        """Return the graph as it is now.

        Returns:
            A snapshot of the domain.

        Raises:
            BrokerUnreachable: No answer within `timeout_sec`, or the link broke.
            ProtocolError: The broker refuses, or violates the protocol.
        """
        snapshot = GraphSnapshot()

        def accept(frame: frames.Graph) -> bool:
            snapshot.apply(frame)
            return not frame.more

        self._ask(frames.Watch(_QUERY, keep=False), frames.Graph, accept)
        return snapshot

    def report(self) -> BrokerReport:
        """Return the broker's counts.

        Returns:
            A report. Two reports give rates: `later.rates_since(earlier)`.

        Raises:
            BrokerUnreachable: No answer within `timeout_sec`, or the link broke.
            ProtocolError: The broker refuses, or violates the protocol.
        """
        parts = ReportParts()

        def accept(frame: frames.Stats) -> bool:
            parts.add(frame)
            return parts.complete

        self._ask(frames.Inspect(_QUERY), frames.Stats, accept)
        return parts.report()

    def definition(self, type_hash: str) -> bytes | None:
        """Return the definition of a type.

        Args:
            type_hash: The type's RIHS01 hash.

        Returns:
            The definition; None if the broker does not know it, or has one with another hash.

        Raises:
            BrokerUnreachable: No answer within `timeout_sec`, or the link broke.
            ProtocolError: The broker refuses, or violates the protocol.
        """
        from proto.wire.type_hash import hash_of  # noqa: PLC0415 - takes time, and few queries need it

        found: list[bytes | None] = []

        def accept(frame: frames.Definition) -> bool:
            if frame.type_hash == type_hash:
                found.append(frame.definition)
            return bool(found)

        self._ask(frames.Describe(type_hash), frames.Definition, accept)
        definition = found[0]
        return definition if definition is None or hash_of(definition) == type_hash else None

    # The wire

    def _start_session(self) -> None:
        self._answer_bytes = 0
        self._session = Session(Role.CLIENT)
        self._receiver = Receiver(self._session, self._scratch, Decoder(), Reassembler())

    def _hello_options(self, url: BrokerUrl) -> dict[str, frames.Scalar]:
        # Random for each inspector: the broker must never take it for a node that comes back.
        identity = os.urandom(limits.INSTANCE_BYTES), os.urandom(limits.INSTANCE_BYTES)
        options: dict[str, frames.Scalar] = dict(zip(("instance", "token"), identity, strict=True))
        options |= {"agent": AGENT, "domain": self._domain}
        if url.is_local and (host := host_identity()) is not None:
            options["host"] = host  # to learn whether the broker shares memory
        return options

    def _greet(self, url: BrokerUrl, deadline: float) -> None:
        self._start_session()
        self._socket = connected_socket(url, _left(deadline))
        if url.tls:
            self._socket.settimeout(_left(deadline))
            self._socket = encrypted = client_context(self._credentials.tls).wrap_socket(
                self._socket, server_hostname=url.host, do_handshake_on_connect=False
            )
            encrypted.do_handshake()
            self.certificate = encrypted.getpeercert() or {}
        options = self._hello_options(url)
        address = "" if url.path else str(self._socket.getpeername()[0])
        token = self._credentials.token_for(address, encrypted=url.tls)
        if token is not None:
            options["auth"] = token
        hello = frames.Hello(limits.PROTOCOL_VERSION, options)
        asked = time.monotonic()
        self._send(hello)
        try:
            welcome = self._next(frames.Welcome, deadline)
        except ProtocolError as error:
            # An HTTP server, say, answers with bytes that are no frames.
            if error.code is ErrorCode.MALFORMED and self._session.state is State.GREETED:
                raise ProtocolError(error.code, f"what listens at {url} is no callboard broker") from error
            if error.code is ErrorCode.UNAUTHORIZED:
                raise refused_credentials(str(url), str(error), self._credentials) from error
            if error.code is ErrorCode.TLS_REQUIRED:
                raise tls_required(url, self._credentials.tls) from error
            raise
        self.round_trip_sec = time.monotonic() - asked
        # Text of a peer goes to terminals: control characters are escaped once, here.
        self.welcome = {
            key: peer_text(value) if isinstance(value, str) else value
            for key, value in welcome.options.items()
        }
        self.clock_ahead_sec = _ahead(welcome.options.get("wall_time_ns"), self.round_trip_sec)

    def _ask(self, query: Frame, kind: type[FrameT], accept: Callable[[FrameT], bool]) -> None:
        """Send a query, and give the parts of the answer to `accept` until it returns True."""
        if self._socket is None:
            raise BrokerUnreachable("The inspector is not connected: use `with Inspector(url) as inspector:`")
        deadline = time.monotonic() + self._timeout_sec
        self._answer_bytes = 0
        started = False
        try:
            self._send(query)
            while not accept(self._next(kind, deadline)):
                started = True
        except OSError as error:
            self._disconnect()
            late = f"No {'complete ' * started}answer from"
            text = late if isinstance(error, TimeoutError) else "The link broke to"
            raise BrokerUnreachable(f"{text} the broker at {self.url}") from error
        except BaseException:
            self._disconnect()
            raise

    def _send(self, frame: Frame) -> None:
        assert self._socket is not None
        self._session.sent(frame)
        self._socket.sendall(encode(frame))

    def _next(self, kind: type[FrameT], deadline: float) -> FrameT:
        """Return the next frame of a kind; answer and skip the others.

        Raises:
            OSError: The connection is gone, or the deadline has passed (TimeoutError).
            ProtocolError: The broker refuses, or violates the protocol.
        """
        while True:
            frame = self._next_frame(deadline)
            if isinstance(frame, kind):
                return frame
            if isinstance(frame, frames.Error):
                raise ProtocolError(_known(frame.code), peer_text(frame.text))
            if isinstance(frame, frames.Goodbye):
                raise ConnectionResetError(peer_text(frame.text))
            # Also in the middle of an answer. A broker takes a client that does not answer for dead.
            if isinstance(frame, frames.Ping):
                self._send(frames.Pong(frame.token))

    def _next_frame(self, deadline: float) -> Frame:
        sock, receiver = cast("socket.socket", self._socket), self._receiver
        while True:
            if time.monotonic() > deadline:  # a stream of frames never waits for the socket
                raise TimeoutError
            frame = receiver.next_frame()
            if frame is not None:
                return frame
            sock.settimeout(_left(deadline))
            received = sock.recv_into(receiver.buffer())
            if not received:
                raise ConnectionResetError("the broker has closed the connection")
            receiver.received(received)
            # The limit holds for what is received, whatever it decodes to: a broker that is not to be
            # trusted cannot make the command line use up the memory.
            self._answer_bytes += received
            if self._answer_bytes > MAX_ANSWER_BYTES:
                text = f"the broker's answer has more than {MAX_ANSWER_BYTES} bytes"
                raise ProtocolError(ErrorCode.LIMIT, text)


def inspector_for(target: BrokerTarget, timeout_sec: float) -> Inspector:
    """Return an inspector of the broker that `find_broker_target` has chosen."""
    return Inspector(
        target.url, domain=target.domain, credentials=target.credentials, timeout_sec=timeout_sec
    )


def _known(code: int) -> ErrorCode:
    """Return the code of an ERROR; that of a later version is taken for INTERNAL."""
    return ErrorCode(code) if code in set(ErrorCode) else ErrorCode.INTERNAL


def _ahead(wall_time_ns: object, round_trip_sec: float) -> float | None:
    """Return how far a clock that was read half a round trip ago is ahead of this machine's."""
    if type(wall_time_ns) is not int:
        return None
    return (wall_time_ns - time.time_ns()) / 1e9 + round_trip_sec / 2


def _unwelcoming(url: BrokerUrl, error: OSError, files: TlsFiles) -> BrokerUnreachable:
    """Return the error about a listener that accepts a connection without a greeting."""
    if isinstance(error, BrokerUnreachable):
        return error
    if is_tls_error(error):
        return tls_failure(error, url, files)
    wrong = "does not answer" if isinstance(error, TimeoutError) else "is no callboard broker"
    return BrokerUnreachable(f"What listens at {url} {wrong}")


def _left(deadline: float) -> float:
    """Return the seconds left for a socket; it takes 0 for "do not wait", and less for an error."""
    return max(0.001, deadline - time.monotonic())


def connected_socket(url: BrokerUrl, timeout_sec: float) -> socket.socket:
    """Connect a blocking socket.

    Args:
        url: The broker. TLS begins later, on the socket.
        timeout_sec: How long it may take, in seconds; also the socket's timeout.

    Raises:
        OSError: Nobody listens there, or the host is unknown.
    """
    if not url.path:
        # As bytes an ASCII name goes as it is; the codec for others takes some milliseconds to be imported.
        host: Any = url.host.encode() if url.host.isascii() else url.host
        try:
            return socket.create_connection((host, url.port), timeout_sec)
        except UnicodeError as error:
            raise socket.gaierror(socket.EAI_NONAME, f"no host can be called {url.host!r}") from error
    sock = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    try:
        sock.settimeout(timeout_sec)
        sock.connect(url.path)
    except BaseException:
        sock.close()
        raise
    return sock
