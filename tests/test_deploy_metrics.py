"""The alerts and the dashboard in deploy/ use metrics that exist, and promtool accepts them."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
import yaml
from prometheus_client.parser import text_string_to_metric_families

from actors.graph.broker_report import BrokerReport
from actors.graph.snapshot import GraphSnapshot
from actors.web.metrics import Metrics
from proto.wire.stats import BrokerStats, MeshBrokerStats, MeshStats

if TYPE_CHECKING:
    from collections.abc import Iterator

DEPLOY = Path(__file__).resolve().parent.parent / "deploy"
ALERTS = DEPLOY / "prometheus" / "alerts.yml"
DASHBOARD = DEPLOY / "grafana" / "callboard.json"


def labels_by_name() -> dict[str, dict[str, set[str]]]:
    """Return the metrics that exist, with the values of their labels."""
    report = BrokerReport(
        totals=BrokerStats(broker="b1"),
        topics={},
        links={},
        brokers={
            1: MeshBrokerStats(1, "here", "1"),
            2: MeshBrokerStats(2, "there", "1", round_trip_us=900),
        },
        mesh=MeshStats(),
    )
    found: dict[str, dict[str, set[str]]] = {}
    text = Metrics().text(report, GraphSnapshot(), 0.0).decode()
    for family in text_string_to_metric_families(text):
        for sample in family.samples:
            labels = found.setdefault(sample.name, {})
            for label, value in sample.labels.items():
                labels.setdefault(label, set()).add(value)
    return found


def dashboard_expressions() -> Iterator[str]:
    """Return the queries of all panels."""
    dashboard: dict[str, Any] = json.loads(DASHBOARD.read_text(encoding="utf-8"))
    for panel in dashboard["panels"]:
        for target in panel["targets"]:
            yield target["expr"]


def alert_expressions() -> Iterator[str]:
    """Return the conditions of all alerts."""
    for group in yaml.safe_load(ALERTS.read_text(encoding="utf-8"))["groups"]:
        for rule in group["rules"]:
            yield rule["expr"]


@pytest.mark.parametrize("expression", [*alert_expressions(), *dashboard_expressions()])
def test_what_operators_watch_exists(expression: str) -> None:
    """Names of metrics and labels, and the values of labels."""
    metrics = labels_by_name()
    names = re.findall(r"callboard_\w+", expression)
    assert names
    assert set(names) <= set(metrics)
    known = {label for name in names for label in metrics[name]} | {"instance"}
    for labels in re.findall(r"by \(([^)]*)\)", expression):
        assert {each.strip() for each in labels.split(",")} <= known
    for name, label, value in re.findall(r'(callboard_\w+)\{(\w+)!?="([^"]*)"\}', expression):
        assert value in metrics[name][label]


def test_promtool_accepts_the_alerts() -> None:
    """Their syntax and their queries."""
    tool = shutil.which("promtool")
    if tool is None:
        pytest.skip("needs promtool (Debian: apt install prometheus)")
    done = subprocess.run([tool, "check", "rules", str(ALERTS)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    ("alert", "series", "values"),
    [
        ("CallboardBrokerDown", "callboard_up", "0x60"),
        ("CallboardBrokerDown", "up", "0x60"),
        ("CallboardWithholdsNumbers", "callboard_withheld", "1x60"),
        ("CallboardRestarted", "callboard_uptime_seconds", "10 1 10 1 10 1 10+15x60"),
        ("CallboardLoopLag", "callboard_loop_lag_longest_seconds", "0.2x60"),
        ("CallboardLosesMessages", 'callboard_lost_copies_total{reason="depth"}', "0+30x60"),
        ("CallboardMemory", 'callboard_closed_links_total{reason="memory"}', "0x30 1x30"),
        ("CallboardRefusesConnections", 'callboard_refused_connections_total{reason="too_many"}', "0+3x60"),
        ("CallboardSuspendedLinks", "callboard_suspended_links", "0 1 1 0 0 0 0 0" + " 1 1 0 0 0 0 0 0" * 7),
        ("CallboardMeshTrouble", 'callboard_mesh_problems_total{reason="dropped"}', "0+30x60"),
    ],
)
def test_the_alerts_fire(alert: str, series: str, values: str, tmp_path: Path) -> None:
    """At some time of a quarter of an hour of the trouble, scraped every 15 s."""
    tool = shutil.which("promtool")
    if tool is None:
        pytest.skip("needs promtool (Debian: apt install prometheus)")
    name, _, labels = series.partition("{")
    whole = ",".join(filter(None, ['instance="robot"', 'job="callboard"', labels.rstrip("}")]))
    fires = f'count by (alertname) (ALERTS{{alertstate="firing",alertname="{alert}"}})'
    test: dict[str, Any] = {
        "rule_files": [str(ALERTS)],
        "evaluation_interval": "15s",
        "tests": [
            {
                "interval": "15s",
                "input_series": [{"series": f"{name}{{{whole}}}", "values": values}],
                "promql_expr_test": [
                    {
                        "expr": f"count(max_over_time({fires}[14m:15s]))",
                        "eval_time": "14m",
                        "exp_samples": [{"labels": "{}", "value": 1}],
                    }
                ],
            }
        ],
    }
    file = tmp_path / "test.yml"
    file.write_text(yaml.safe_dump(test))
    done = subprocess.run([tool, "test", "rules", str(file)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def test_promtool_accepts_the_configuration_of_the_guide(tmp_path: Path) -> None:
    """Which has the token that the page's server was given."""
    tool = shutil.which("promtool")
    if tool is None:
        pytest.skip("needs promtool (Debian: apt install prometheus)")
    guide = (DEPLOY.parent / "docs" / "how-to" / "browser.md").read_text(encoding="utf-8")
    (block,) = re.findall(r"```yaml\n(.*?)```", guide, re.DOTALL)
    file = tmp_path / "prometheus.yml"
    file.write_text(block)
    subprocess.run([tool, "check", "config", "--syntax-only", file], check=True, capture_output=True)


def test_promtool_accepts_the_metrics() -> None:
    """Each has a description, and the name that Prometheus expects of its kind."""
    tool = shutil.which("promtool")
    if tool is None:
        pytest.skip("needs promtool (Debian: apt install prometheus)")
    report = BrokerReport(totals=BrokerStats(), topics={}, links={})
    text = Metrics().text(report, GraphSnapshot(), 0.0)
    done = subprocess.run([tool, "check", "metrics"], input=text, capture_output=True, check=False)
    assert (done.returncode, done.stderr, done.stdout) == (0, b"", b"")
