"""Credentials: where a token comes from, where it may go, and that nothing shows it."""

from __future__ import annotations

import os
import pickle
import threading
import traceback
from typing import TYPE_CHECKING

import pytest

from actors.config.context_errors import ContextError
from actors.config.contexts import Context, Contexts, find_broker_target
from actors.config.credentials import Credentials, Secret, find_credentials
from actors.config.environment import InvalidEnvironmentError, own_variables
from actors.errors import NotAuthorized
from actors.tools.security_checks import check_files
from proto.aio.tls import client_context
from proto.errors import TlsFileError
from proto.wire.tls import TlsFiles
from tests.certificates import Authority

if TYPE_CHECKING:
    from pathlib import Path

TOKEN = "cbt_" + "t" * 43


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """A file with a token."""
    path = tmp_path / "token"
    path.write_text(TOKEN + "\n")
    return path


@pytest.fixture(autouse=True)
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Have a context of the test's own."""
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))


def test_the_file_has_priority_over_the_variable(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """CALLBOARD_TOKEN_FILE, then CALLBOARD_TOKEN; the file is read for each connection."""
    assert find_credentials().token_for("", encrypted=False) is None
    monkeypatch.setenv("CALLBOARD_TOKEN", "other")
    assert find_credentials().token_for("", encrypted=False) == "other"
    monkeypatch.setenv("CALLBOARD_TOKEN_FILE", str(file))
    found = find_credentials()
    assert found.token_for("", encrypted=False) == TOKEN
    file.write_text("replaced")
    assert found.token_for("", encrypted=False) == "replaced"


def test_files_for_tls_come_from_the_environment_and_the_context(monkeypatch: pytest.MonkeyPatch) -> None:
    """The variables win over the context in use, a named context over the variables; a pair stays one."""
    with Contexts.changing() as contexts:
        contexts.add("lab", Context(url="callboards://lab", ca="/lab.pem", cert="/c.pem", key="/c.key"))
        contexts.use("lab")
    lab = TlsFiles("/lab.pem", "/c.pem", "/c.key")
    assert find_broker_target().credentials.tls == lab
    assert find_broker_target("callboards://other").credentials.tls == TlsFiles()
    monkeypatch.setenv("CALLBOARD_CA", "/ours.pem")
    assert find_broker_target().credentials.tls == lab._replace(ca="/ours.pem")
    found = find_broker_target(context="lab").credentials
    assert found.tls == lab
    assert found.variables() == {
        "CALLBOARD_CA": "/lab.pem",
        "CALLBOARD_CERT": "/c.pem",
        "CALLBOARD_KEY": "/c.key",
    }


@pytest.mark.parametrize(
    ("context", "text"),
    [
        (Context(ca="ca.pem"), "ca must be an absolute path"),
        (Context(cert="/c.pem"), "cert and key belong together"),
    ],
)
def test_wrong_files_of_a_context(context: Context, text: str) -> None:
    """They are refused when the context is added."""
    with Contexts.changing() as contexts, pytest.raises(ContextError, match=text):
        contexts.add("lab", context)


def test_a_contexts_token_goes_to_its_broker_only(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A named context wins over the environment; one in use does not; another URL gets nothing of it."""
    with Contexts.changing() as contexts:
        contexts.add("robot", Context(url="callboard://robot", token_file=str(file)))
        contexts.use("robot")
    own = Credentials(token_file=str(file))
    assert find_broker_target().credentials == own
    assert find_broker_target(context="robot").credentials == own
    assert find_broker_target("callboard://other").credentials == Credentials()
    assert find_broker_target("callboard://other", context="robot").credentials == Credentials()
    monkeypatch.setenv("CALLBOARD_TOKEN", TOKEN)
    assert find_broker_target().credentials == Credentials(token=Secret(TOKEN))
    assert find_broker_target(context="robot").credentials == own


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs named pipes")
def test_a_named_pipe_is_read_only_where_the_user_names_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Case 86: a stored context's would be waited for; `CALLBOARD_TOKEN_FILE=<(...)` is meant."""
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    with Contexts.changing() as contexts:
        contexts.add("robot", Context(url="callboard://robot", token_file=str(pipe)))
    with pytest.raises(NotAuthorized, match=f"token file {pipe}: not a regular file"):
        find_broker_target(context="robot").credentials.token_for("", encrypted=False)
    monkeypatch.setenv("CALLBOARD_TOKEN_FILE", str(pipe))
    writer = threading.Thread(target=pipe.write_text, args=(TOKEN,))
    writer.start()
    assert find_credentials().token_for("", encrypted=False) == TOKEN
    writer.join()


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs named pipes")
@pytest.mark.parametrize("field", ["ca", "certificate", "key"])
def test_a_named_pipe_in_the_place_of_a_file_for_tls_is_not_waited_for(tmp_path: Path, field: str) -> None:
    """Case 86: neither by connections nor by the checks of `callboard doctor`."""
    pair, pipe = Authority(tmp_path).issue("localhost"), tmp_path / "pipe"
    os.mkfifo(pipe)
    files = TlsFiles(certificate=str(pair.certificate), key=str(pair.key))._replace(**{field: str(pipe)})
    with pytest.raises(TlsFileError, match=f"Cannot read {pipe}: not a regular file"):
        client_context(files)
    (check,) = check_files({}, {field: str(pipe)})
    assert "not a regular file" in check.finding


@pytest.mark.parametrize("content", ["", "\n", "two words", "ä", "x" * 600, None])
def test_a_broken_token_file_is_an_error_without_its_content(tmp_path: Path, content: str | None) -> None:
    """Case 34: an empty or unreadable file does not mean to go without a token."""
    path = tmp_path / "token"
    if content is not None:
        path.write_text(content)
    with pytest.raises(NotAuthorized, match="token file") as caught:
        Credentials(token_file=str(path)).token_for("", encrypted=False)
    assert not content or content.isspace() or content not in str(caught.value)


@pytest.mark.parametrize(
    ("host", "encrypted", "insecure", "goes"),
    [
        ("", False, False, True),
        ("127.0.0.1", False, False, True),
        ("::1", False, False, True),
        ("::ffff:127.0.0.1", False, False, True),
        ("192.0.2.1", True, False, True),
        ("192.0.2.1", False, True, True),
        ("192.0.2.1", False, False, False),
        ("2001:db8::1", False, False, False),
        ("?", False, False, False),
    ],
)
def test_a_token_does_not_go_over_plain_tcp(host: str, encrypted: bool, insecure: bool, goes: bool) -> None:
    """To another machine it needs TLS, or CALLBOARD_INSECURE."""
    credentials = Credentials(token=Secret(TOKEN), insecure=insecure)
    if goes:
        assert credentials.token_for(host, encrypted=encrypted) == TOKEN
    else:
        with pytest.raises(NotAuthorized, match=r"TLS.*CALLBOARD_INSECURE=1") as caught:
            credentials.token_for(host, encrypted=encrypted)
        assert TOKEN not in str(caught.value)


def test_insecure_is_one_or_zero(monkeypatch: pytest.MonkeyPatch) -> None:
    """A typing error does not open anything."""
    assert not find_credentials().insecure
    for value, insecure in (("1", True), ("0", False)):
        monkeypatch.setenv("CALLBOARD_INSECURE", value)
        assert find_credentials().insecure is insecure
    monkeypatch.setenv("CALLBOARD_INSECURE", "yes")
    with pytest.raises(InvalidEnvironmentError, match="must be 1 or 0"):
        find_credentials()


def test_nothing_shows_a_token(monkeypatch: pytest.MonkeyPatch) -> None:
    """Case 33: neither repr nor format, pickles, tracebacks, targets or lists of variables."""
    monkeypatch.setenv("CALLBOARD_TOKEN", TOKEN)
    secret = Secret(TOKEN)
    target = find_broker_target()
    shown = [repr(secret), f"{secret}", f"{secret!r:>20}", str(target), repr(target._asdict())]
    try:
        raise ValueError(secret, target)
    except ValueError as error:
        shown += traceback.format_exception(error)
    shown.append(str(own_variables()))
    assert not [text for text in shown if TOKEN in text]
    with pytest.raises(TypeError, match="cannot be pickled"):
        pickle.dumps(target)
