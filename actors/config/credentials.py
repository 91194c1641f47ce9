"""A client's credentials and the authorities that it trusts: their sources, and where a token may be sent."""

# Every command and node imports this: pathlib would cost some milliseconds.
# ruff: noqa: PTH123
from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Final

from actors.config import environment
from actors.errors import NotAuthorized
from actors.regular_files import read_regular
from proto.limits import MAX_TOKEN_CHARACTERS
from proto.untrusted_text import escape
from proto.wire.tls import NO_FILES, TlsFiles

_FILE_VARIABLES: Final = ("CALLBOARD_TOKEN_FILE", "CALLBOARD_CA", "CALLBOARD_CERT", "CALLBOARD_KEY")


class Secret:
    """A text that only `reveal` returns: it is not in logs, tracebacks or the repr of its owner.

    Args:
        text: The secret.
    """

    __slots__ = ("_text",)

    def __init__(self, text: str) -> None:
        self._text = text

    def reveal(self) -> str:
        """Return the text, to send it."""
        return self._text

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Secret) and other._text == self._text

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return "Secret(...)"

    def __reduce__(self) -> str:
        raise TypeError("a Secret cannot be pickled")


@dataclass(frozen=True, slots=True, kw_only=True)
class Credentials:
    """The credentials that a client presents to its broker.

    Attributes:
        token: The token; None to read `token_file`.
        source: Where `token` is from, for messages.
        token_file: A file with the token, read for each connection, so that it may be replaced; "" for none.
        from_context: Whether a stored context names that file, so that it has to be a regular one.
        insecure: Whether the token may be sent over plain TCP to other machines.
        tls: The files for TLS.
    """

    token: Secret | None = None
    source: str = "CALLBOARD_TOKEN"
    token_file: str = ""
    from_context: bool = field(default=False, compare=False)
    insecure: bool = False
    tls: TlsFiles = NO_FILES

    def variables(self) -> dict[str, str]:
        """Return the environment variables that name the same files, for programs."""
        values = (self.token_file, self.tls.ca, self.tls.certificate, self.tls.key)
        return {name: value for name, value in zip(_FILE_VARIABLES, values, strict=True) if value}

    def with_token(self, token: str) -> Credentials:
        """Return the same with a token that the program itself has given.

        Args:
            token: The token.
        """
        return replace(self, token=Secret(token), source="the argument `token`", token_file="")

    def token_for(self, host: str, *, encrypted: bool) -> str | None:
        """Return the token to send on a connection, or None.

        Args:
            host: The address of the broker, as the connection reports it; "" for a unix socket.
            encrypted: Whether the connection uses TLS.

        Raises:
            NotAuthorized: The token's file cannot be read, or the token would travel in the clear.
        """
        token = self.token
        if token is None and self.token_file:
            token = _read(self.token_file, regular=self.from_context)
        if token is None:
            return None
        from proto.wire.addresses import is_loopback  # noqa: PLC0415 - only with a token

        if not (encrypted or self.insecure or not host or is_loopback(host)):
            raise NotAuthorized(
                f"The token is not sent to {host} over plain TCP, where others could read it: use TLS, or set"
                " CALLBOARD_INSECURE=1 if the network is trusted"
            )
        return token.reveal()


def refused_credentials(url: str, text: str, presented: Credentials) -> NotAuthorized:
    """Return the error about a broker that has refused what was presented.

    Args:
        url: The broker.
        text: Its reason.
        presented: The credentials that it has refused.
    """
    source = presented.token_file or ("" if presented.token is None else presented.source)
    hint = "Name a file with a token in CALLBOARD_TOKEN_FILE; `callboard auth token` makes one"
    if source:
        remedy = "if it is wrong, `callboard auth token` makes another"
        hint = f"This client presented the token in {escape(source)}; {remedy}"
    return NotAuthorized(f"The broker at {url} refuses this client: {escape(text)}. {hint}.")


def find_credentials(
    context_file: str = "", context_tls: TlsFiles = NO_FILES, *, named: bool = False
) -> Credentials:
    """Return the credentials that the environment or a context names.

    Args:
        context_file: The token file of the context whose broker is meant; "" for none.
        context_tls: The files for TLS of that context.
        named: Whether the caller has named that context, so that it wins over the environment.

    Raises:
        InvalidEnvironmentError: CALLBOARD_INSECURE is invalid.
    """
    file, token = environment.token_file() or "", environment.token()
    from_context = bool(context_file) and (named or not (file or token))
    if from_context:
        file, token = context_file, None
    return Credentials(
        token=Secret(token) if token and not file else None,
        token_file=file,
        from_context=from_context,
        insecure=environment.insecure(),
        tls=_join(context_tls, environment.tls_files(), named=named),
    )


def _join(own: TlsFiles, general: TlsFiles, *, named: bool) -> TlsFiles:
    """Return the files of a context, and of the environment where those are missing or do not win."""
    first, second = (own, general) if named else (general, own)
    pair = first if first.certificate or first.key else second
    return TlsFiles(first.ca or second.ca, pair.certificate, pair.key)


def _read(file: str, *, regular: bool) -> Secret:
    """Return the token in a file."""
    most = MAX_TOKEN_CHARACTERS + 2
    try:
        if regular:
            content = read_regular(file, most)
        else:
            with open(file, "rb") as stream:
                content = stream.read(most)
        text = content.decode("ascii").strip()
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else "it is not ASCII"
        raise NotAuthorized(f"Cannot read the token file {file}: {reason}") from None
    if not text or len(text) > MAX_TOKEN_CHARACTERS or len(text.split()) > 1:
        raise NotAuthorized(f"The token file {file} must have one line with one token")
    return Secret(text)
