"""What can be a dependency is what the packaging library takes for one."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from packaging.requirements import InvalidRequirement, Requirement

from actors.tools.requirement import MAX_LENGTH, is_requirement

WORDS = (
    "numpy x a-b.c [dev] [] >=2 ==1.* ~=1.4 ~=1 <3 !=2.0rc1 ==1+x ===any , ; ( ) @ https://a.org/x rm"
    " -rf = 1.0.post1 python_version '3.11' sys_platform and or in not < * [a"
)
PIECES = (*WORDS.split(), " ", " and ", " or ", " in ")


@pytest.mark.parametrize(
    "text",
    [
        "numpy",
        "numpy>=2",
        "numpy >= 2, < 3",
        "numpy (>=2)",
        "ruamel.yaml[jinja2,x]~=0.18",
        "torch==2.1.*",
        "a==1!2.0rc1.post2.dev3+cu121",
        "numpy>=2; python_version>'3.11'",
        "x ; sys_platform == 'linux' and 'arm' in platform_machine",
        "x @ git+https://example.org/x.git@main",
        "x @ file:///tmp/x.whl ; os_name != 'nt'",
    ],
)
def test_what_pip_installs(text: str) -> None:
    """All forms that people write."""
    Requirement(text)
    assert is_requirement(text)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "x; rm",
        "x; rm -rf ~",
        "x;",
        "x>=",
        "x=2",
        "x>=2 <3",
        "x[",
        "x[a b]",
        "x y",
        "--index-url",
        "-e .",
        "x\n",
        "x @ ",
        "x>=1.*",
        "x~=1",
        "x" * (MAX_LENGTH + 1),
    ],
)
def test_what_pip_refuses(text: str) -> None:
    """And what somebody else's shell would run."""
    assert not is_requirement(text)


@given(st.lists(st.sampled_from(PIECES), max_size=8).map("".join))
def test_nothing_gets_through_that_pip_refuses(text: str) -> None:
    """Whatever is put together of the pieces of requirements."""
    if is_requirement(text):
        try:
            Requirement(text)
        except InvalidRequirement as error:
            pytest.fail(f"{text!r}: {error}")
