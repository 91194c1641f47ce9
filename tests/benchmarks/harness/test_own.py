"""callboard as a contender: the command lines of its broker."""

from __future__ import annotations

from pathlib import Path

from benchmarks.harness.own import callboard
from broker.access.files import load_rules
from broker.access.origin import LOCAL
from broker.access.rules import Action


def test_rules_of_a_broker_allow_the_roles_everything(tmp_path: Path) -> None:
    """As many as asked for, and those of the roles are the last of each action."""
    contender = callboard(rules=1000)
    assert contender.name == "callboard (1,000 rules)"
    assert contender.server_command is not None
    command = contender.server_command(7411, tmp_path)
    file = Path(command[command.index("--auth") + 1])
    assert 1000 <= file.read_text().count("/**") <= 1010
    user = load_rules(file).authenticate(LOCAL, None)
    assert user is not None
    assert all(user.rights.may(action, "/any/name") for action in Action)
