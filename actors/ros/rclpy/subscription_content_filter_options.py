"""Filters by the content of messages, as programs give them."""

from __future__ import annotations

from typing import NamedTuple


class ContentFilterOptions(NamedTuple):
    """A filter in the language of SQL, and the values of its parameters, such as `%0`."""

    filter_expression: str
    expression_parameters: list[str]
