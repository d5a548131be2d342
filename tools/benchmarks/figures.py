"""The benchmarks' output: a table of figures, and the computer they come from."""

import os
import platform
import statistics
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from planner.cli.printing import console
from planner.provenance import versions


@dataclass(frozen=True)
class Figure:
    """One thing measured, several times."""

    what: str
    unit: str
    values: tuple[float, ...]
    at_most: float | None = None  # the target
    at_least: float | None = None

    @property
    def median(self) -> float:
        """The value that is reported."""
        return statistics.median(self.values)

    @property
    def kept(self) -> bool | None:
        """Whether the target is kept; None without one."""
        if self.at_least is not None:
            return self.median >= self.at_least
        return None if self.at_most is None else self.median <= self.at_most

    @property
    def target(self) -> str:
        """The target in words; empty without one."""
        if self.at_least is not None:
            return f">= {self.at_least:,g}"
        return "" if self.at_most is None else f"{self.at_most:,g}"


def machine() -> dict[str, Any]:
    """Return what the figures were measured on."""
    described = Path("/proc/cpuinfo")
    lines = described.read_text(encoding="utf-8").splitlines() if described.exists() else []
    models = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return {
        "cpu": models[0] if models else platform.processor() or platform.machine(),
        "cores": os.cpu_count(),
        "system": platform.platform(),
        "python": platform.python_version(),
        "load": os.getloadavg()[0],
        "versions": versions(),
    }


def show(figures: Sequence[tuple[str, Figure]], host: dict[str, Any]) -> None:
    """Print the table, and what it was measured on."""
    from rich.table import Table

    table = Table(title="medians; from the least to the greatest", title_justify="left")
    for name in ("section", "what"):
        table.add_column(name)
    for name in ("median", "range", "unit", "target", "kept"):
        table.add_column(name, justify="right" if name != "unit" else "left")
    before = ""
    for section, figure in figures:
        table.add_row("" if section == before else section, *_texts(figure))
        before = section
    out = console()
    out.print(table)
    known = ", ".join(f"{name} {version}" for name, version in host["versions"].items() if version)
    out.print(f"{host['cpu']}, {host['cores']} cores, load {host['load']:.1f} before")
    out.print(f"{host['system']}, python {host['python']}, {known}")


def _texts(figure: Figure) -> Iterator[str]:
    yield from (figure.what, _number(figure.median))
    low, high = min(figure.values), max(figure.values)
    yield f"{_number(low)} .. {_number(high)}" if len(figure.values) > 1 else ""
    yield figure.unit
    yield figure.target
    yield {None: "", True: "yes", False: "NO"}[figure.kept]


def _number(value: float) -> str:
    return f"{value:,.0f}" if value >= 100 else f"{value:.3g}"
