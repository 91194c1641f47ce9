"""Generate the part of docs/explanation/resilience.md between its markers from a report."""

from __future__ import annotations

import msgspec

from benchmarks.faults.figures import Section  # noqa: TC001 - msgspec reads it when the class is made
from benchmarks.report import spliced, table

BEGIN = "<!-- results: made by benchmarks/resilience.py -->"
END = "<!-- end of results -->"


class Report(msgspec.Struct, kw_only=True):
    """All results measured on one machine."""

    machine: dict[str, str]
    date: str
    """Of the last measurement."""
    sections: dict[str, Section]

    def merged_with(self, older: Report) -> Report:
        """Return this report with the sections that only an older one has."""
        sections = older.sections | self.sections
        return Report(machine=self.machine, date=self.date, sections=sections)


def update_page(page: str, report: Report) -> str:
    """Return the page with a report between its markers.

    Raises:
        ValueError: A marker is missing.
    """
    return spliced(page, BEGIN, END, body(report))


def body(report: Report) -> str:
    """Return all tables as Markdown."""
    machine = ", ".join(f"{name} {value}" for name, value in report.machine.items())
    parts = [f"Measured on {report.date[:10]}: {machine}."]
    for section in report.sections.values():
        title = section.title[0].upper() + section.title[1:]
        parts += [f"### {title}", section.text, table(section.heading, section.rows)]
        parts += [f"**Not kept:** {failure}." for failure in section.failures]
    return "\n\n".join(parts)
