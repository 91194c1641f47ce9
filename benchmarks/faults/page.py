"""docs/explanation/resilience.md: what stands between its markers is made from a report."""

from __future__ import annotations

import msgspec

from benchmarks.faults.figures import Section  # noqa: TC001 - msgspec reads it when the class is made
from benchmarks.report import spliced, table

BEGIN = "<!-- results: made by benchmarks/resilience.py -->"
END = "<!-- end of results -->"


class Report(msgspec.Struct, kw_only=True):
    """Everything that has been measured on a machine."""

    machine: dict[str, str]
    date: str
    """Of the last measurement."""
    sections: dict[str, Section]

    def beside(self, older: Report) -> Report:
        """Return this report with an older one's sections where this has none."""
        sections = older.sections | self.sections
        return Report(machine=self.machine, date=self.date, sections=sections)


def updated(page: str, report: Report) -> str:
    """Return the page with a new report between its markers.

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
