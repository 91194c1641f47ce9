"""Results as a picture: small multiples of bars, one panel for each figure worth a glance.

No background and text of middle grey, so that it reads on light and on dark pages.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any, NamedTuple

from actors.cli.bench.results import number

if TYPE_CHECKING:
    from pathlib import Path

    from benchmarks.harness.results import Results, Spread

INK = "#808890"
OWN = "#2f81f7"
OWN_FORM = "#84b4f5"
PEER = "#aab2bb"
COLUMNS = 2


class Panel(NamedTuple):
    """One figure of one case."""

    workload: str
    case: str
    key: str
    title: str
    scale: float = 1.0
    less_is_better: bool = False


PANELS = (
    Panel("W1", "256 B", "rate", "1 publisher, 1 subscriber, 256 B: thousand msg/s", 1e-3),
    Panel("W1", "4 KiB", "rate", "4 KiB: thousand msg/s", 1e-3),
    Panel("W1", "64 KiB", "mb_s", "64 KiB: MB/s"),
    Panel("W1", "1 MiB", "mb_s", "1 MiB: MB/s"),
    Panel("W2", "256 B", "rate", "10 subscribers: thousand delivered msg/s", 1e-3),
    Panel("W4", "100 in flight", "rate", "100 calls in flight: thousand req/s", 1e-3),
    Panel("W3", "1 in flight", "p50_us", "one call at a time: median µs", less_is_better=True),
    Panel("W5", "10,000", "kib", "10,000 idle links: KiB each", less_is_better=True),
)


def draw(results: Results, path: Path) -> None:
    """Write the picture; the file's ending says what it is."""
    matplotlib: Any = import_module("matplotlib")
    matplotlib.use("Agg")
    pyplot: Any = import_module("matplotlib.pyplot")
    panels = [(panel, bars) for panel in PANELS if (bars := _bars(results, panel))]
    if not panels:
        return
    style = {
        "text.color": INK,
        "axes.labelcolor": INK,
        "xtick.color": INK,
        "ytick.color": INK,
        "font.size": 9,
        "svg.hashsalt": "callboard",  # the same picture has the same bytes
    }
    with pyplot.rc_context(style):
        rows = -(-len(panels) // COLUMNS)
        tallest = max(len(bars) for _, bars in panels)
        figure, axes = pyplot.subplots(
            rows, COLUMNS, figsize=(11, rows * (0.7 + 0.22 * tallest)), squeeze=False, layout="constrained"
        )
        for axis in axes.flat[len(panels) :]:
            axis.set_visible(False)
        for axis, (panel, bars) in zip(axes.flat, panels, strict=False):
            _panel(axis, panel, bars)
        metadata = {"Date": None} if path.suffix == ".svg" else None
        figure.savefig(path, transparent=True, metadata=metadata, dpi=100)
        pyplot.close(figure)


def _bars(results: Results, panel: Panel) -> list[tuple[str, Spread]]:
    """Return the contenders with the figure, the worst first, so that the best bar is on top."""
    found = [
        (entrant.name, results.figures(panel.workload, panel.case, entrant.name).get(panel.key))
        for entrant in results.entrants
    ]
    bars = [(name, figure) for name, figure in found if figure is not None]
    return sorted(bars, key=lambda bar: bar[1].median, reverse=panel.less_is_better)


def _panel(axis: Any, panel: Panel, bars: list[tuple[str, Spread]]) -> None:
    names = [name.replace("router, shared", "shared") for name, _ in bars]
    medians = [panel.scale * figure.median for _, figure in bars]
    below = [panel.scale * (figure.median - figure.least) for _, figure in bars]
    above = [panel.scale * (figure.most - figure.median) for _, figure in bars]
    colors = [_color(name) for name in names]
    whiskers = {"ecolor": INK, "elinewidth": 1, "capsize": 2}
    axis.barh(names, medians, xerr=(below, above), color=colors, height=0.72, error_kw=whiskers)
    widest = max(median + more for median, more in zip(medians, above, strict=True))
    for place, (median, more) in enumerate(zip(medians, above, strict=True)):
        axis.text(median + more + 0.012 * widest, place, number(median), va="center", fontsize=8)
    axis.set_xlim(0, 1.13 * widest)
    note = " (less is better)" if panel.less_is_better else ""
    axis.set_title(f"{panel.workload}  {panel.title}{note}", loc="left", fontsize=9.5, fontweight="bold")
    axis.xaxis.set_visible(False)
    axis.tick_params(axis="y", length=0)
    for spine in axis.spines.values():
        spine.set_visible(False)
    for label in axis.get_yticklabels():
        if label.get_text() == "callboard":
            label.set_color(OWN)
            label.set_fontweight("bold")


def _color(name: str) -> str:
    if name == "callboard":
        return OWN
    return OWN_FORM if name.startswith("callboard") else PEER
