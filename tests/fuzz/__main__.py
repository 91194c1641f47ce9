"""Fuzz one target with coverage guidance: `python -m tests.fuzz codec -max_total_time=60`.

It needs the extra `fuzz` (atheris). Inputs that reach new code go to `build/fuzz/<target>`, an input that
fails into `build/fuzz`; further arguments are libFuzzer's. `tests.fuzz.keep` adds to the corpus.
"""

from __future__ import annotations

import sys
from importlib import import_module
from pathlib import Path

from tests.fuzz.test_corpus import CORPUS, TARGETS

PACKAGES = ("proto", "broker", "actors")
TIMEOUT_SEC = 60
"""For one input. It finds endless work; tests have no such limit, because they would measure the machine."""
BUILD = Path(__file__).parents[2] / "build" / "fuzz"


def main() -> None:
    """Fuzz until the time is over or an input fails."""
    import atheris  # noqa: PLC0415 - an extra

    target, options = sys.argv[1], sys.argv[2:]
    if target not in TARGETS:
        raise SystemExit(f"targets: {', '.join(TARGETS)}")
    found, corpus = BUILD / target, CORPUS / target
    found.mkdir(parents=True, exist_ok=True)
    with atheris.instrument_imports(include=list(PACKAGES)):
        check = import_module(f"tests.fuzz.{target}").check
    prefix = f"-artifact_prefix={BUILD}/{target}-"
    words = CORPUS / f"{target}.dict"
    if words.exists():
        options.append(f"-dict={words}")
    atheris.Setup(
        [
            sys.argv[0],
            str(found),
            str(corpus),
            prefix,
            "-rss_limit_mb=2048",
            f"-timeout={TIMEOUT_SEC}",
            *options,
        ],
        check,
    )
    atheris.Fuzz()


if __name__ == "__main__":
    main()
