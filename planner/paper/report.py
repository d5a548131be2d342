"""One report on all experiments of the paper: a page of claims, with figures."""

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path

from planner.experiments.results import Row
from planner.experiments.run import Results
from planner.files import written_whole
from planner.paper import (
    claims_distance,
    claims_knowledge,
    claims_orders,
    claims_speed,
    figures,
    online,
)
from planner.paper.claims import Claim, judged, page
from planner.paper.figures import U0
from planner.report.estimates import FOUND, estimate

PAGE, CURVES = "claims.md", "curves.csv"
CURVE = ("targets", "block", "method", U0)
JUDGES = (
    claims_distance.claims,
    claims_speed.claims,
    claims_orders.claims,
    claims_knowledge.claims,
    online.claims,
)
HEAD = """\
# The claims of the paper, tested

Kamrani and Ayani, *Simulation-aided path planning of UAV*, 2007: its claims, the interpretation
under which each was tested, and the result. `planner experiment paper` made this page and all
numbers in it. Intervals are 95 %, Student's, over seeds; differences are paired, as all methods
meet the same futures and the same targets. Where no interval stands, nothing in the number is left
to chance.
"""
QUICK = """
**This is a quick run: few levels, seeds and particles. It shows that all works, and no more.**
"""
NUMBERS = f"The numbers of Figures 8 and 9 stand in [{CURVES}]({CURVES}), bands are 95 % intervals."
CAPTIONS = {
    "figure8": "Average detection time on four paths, speeds from 15 to 25 m/s (Figure 8)",
    "figure8-20mps": "The same at 20 m/s",
    "figure8-all": "The same over all paths by their probability",
    "figure9": "Detection time for three speeds of the target (Figure 9)",
    "section4": "E[min(tau, horizon)] of all orders of Figure 3 (Section 4.1)",
    "particles": "What plans are worth against the particles they were made on",
}


def write_report(
    folder: Path, found: Mapping[str, Results], claims: Sequence[Claim], *, quick: bool
) -> Path:
    """Write the page of claims, its figures and their numbers, and return the page's path.

    Parameters
    ----------
    found
        The experiments' results by name; those that are missing are left out.
    claims
        What `claims_of` says of them.
    quick
        Whether they are too small to say anything, which the page then says.
    """
    stems = drawn(folder, found)
    write_curves(folder / CURVES, found)
    pictures = [f"![{CAPTIONS[stem]}]({stem}.png)\n*{CAPTIONS[stem]}.*" for stem in stems]
    parts = [HEAD + (QUICK if quick else ""), page(claims)]
    if pictures:
        parts.append("\n\n".join(["## Figures", NUMBERS, *pictures]) + "\n")
    with written_whole(folder / PAGE) as new:
        new.write_text("\n".join(parts), encoding="utf-8")
    return folder / PAGE


def write_curves(path: Path, found: Mapping[str, Results]) -> None:
    """Write the means and intervals over seeds that Figures 8 and 9 are drawn from, as a table."""
    with written_whole(path) as new, new.open("w", newline="", encoding="utf-8") as to:
        table = csv.writer(to, lineterminator="\n")
        table.writerow(["figure", *CURVE, "mean_s", "low_s", "high_s", "detection_probability"])
        for figure in ("figure8", "figure9"):
            rows = found[figure].rows if figure in found else ()
            groups: dict[tuple[object, ...], list[Row]] = {}
            for row in rows:
                groups.setdefault(tuple(row[key] for key in CURVE), []).append(row)
            for key, group in groups.items():
                time_s, share = estimate(group, {}), estimate(group, {}, FOUND)
                if time_s and share:
                    shown = [f"{value:.1f}" for value in (time_s.mean, time_s.low, time_s.high)]
                    table.writerow([figure, *key, *shown, f"{share.mean:.4f}"])


def claims_of(found: Mapping[str, Results]) -> list[Claim]:
    """Return all claims that the experiments at hand can say something of."""
    return judged(found, JUDGES)


def drawn(folder: Path, found: Mapping[str, Results]) -> list[str]:
    """Draw what there is to draw of the experiments at hand, and return the files' stems."""
    stems: list[str] = []
    if "figure8" in found:
        rows = found["figure8"].rows
        stems.append(figures.figure8(rows, folder))
        stems.append(figures.figure8(rows, folder, speed=", 20 m/s"))
        stems.append(figures.figure8_all(rows, folder))
    if "figure9" in found:
        stems.append(figures.figure9(found["figure9"].rows, folder))
    if "section4" in found:
        stems.append(figures.section4(_panels(found["section4"]), folder))
    if "particles" in found:
        biased = claims_knowledge.with_bias(found["particles"].rows)
        stems.append(figures.particles(biased, folder))
    return stems


def _panels(results: Results) -> list[tuple[dict[str, object], Mapping[str, object]]]:
    firsts = {row["id"]: row for row in results.rows}
    studied = [(dict(row), results.figures[one]) for one, row in firsts.items()]
    return [(row, found) for row, found in studied if "counts" in found]
