"""Claims of Sections 3 and 4 on orders of roads: what is bound to find, and what is best."""

from collections.abc import Iterator, Sequence

from planner.experiments.results import Row
from planner.messages import percent
from planner.paper.claims import Claim, ResultsByName, markdown_table
from planner.paper.figures import U0
from planner.paper.optimum import BOUND
from planner.report.estimates import EXPECTED, FOUND, estimate, levels
from planner.report.formats import km

TAKE_OFF, TRANSIT = "uav.take_off_s", "sensor.detects_in_transit"
CERTAIN = 1.0 - 1e-9
PAPERS_MOVEMENTS = 2
PAPERS_ORDERS = 645_120


def claims(found: ResultsByName) -> Iterator[Claim]:
    """Yield what the studies of orders say of the paper's claims."""
    if "section3" in found:
        rows = _sound(found["section3"].rows)
        yield _breadth_first(rows)
        yield _precedence(rows, _sound(found["guarantee"].rows) if "guarantee" in found else [])
        yield _movements(rows)
    if "guarantee" in found:
        yield _guarantee(_sound(found["guarantee"].rows))
    if "optimum" in found:
        yield _from_optimal(_sound(found["optimum"].rows))
    if "section4" in found:
        yield _all_orders(_sound(found["section4"].rows))
        yield _greedy_is_good(_sound(found["section4"].rows))


def _sound(rows: Sequence[Row]) -> list[Row]:
    return [row for row in rows if row.get("reason") is None]


def _keeps_precedence(row: Row) -> bool:
    return not row["order"].startswith("breadth-first")


def _breadth_first(rows: Sequence[Row]) -> Claim:
    lines = []
    missed = 0.0
    for take_off_s in levels(rows, TAKE_OFF):
        cells = [f"{take_off_s:,.0f} s"]
        for order in ("breadth-first", "breadth-first, as printed"):
            for transit in ("false", "true"):  # as tables hold them
                some = [
                    1.0 - row[FOUND]
                    for row in rows
                    if (row["order"], row[TAKE_OFF], row[TRANSIT]) == (order, take_off_s, transit)
                ]
                if some:
                    cells.append(percent(max(some)))
                    missed = max(missed, *some)
        lines.append(cells)
    return Claim(
        "Breadth-first search sometimes fails to detect the target",
        "Section 3",
        "Figure 1, no horizon; targets that drive to G or stop on the way, the worse of the two; "
        "the sensor on along roads only, or between them as well",
        "reproduced" if missed > 0 else "not reproduced",
        f"Up to {percent(missed)} of the targets are missed for ever.{_left_out(rows)}",
        markdown_table(
            ["take-off", "rule, roads only", "rule, always on", "printed, roads", "printed, on"],
            lines,
        ),
    )


def _left_out(rows: Sequence[Row]) -> str:
    """Tell which roads the breadth-first orders never fly, by the name of the order."""
    orders = {row["order"]: row["never_flown"] for row in rows if not _keeps_precedence(row)}
    unflown = [f"{order}: {roads or 'none'}" for order, roads in orders.items()]
    return f" Roads that are never flown: {'; '.join(unflown)}."


def _precedence(rows: Sequence[Row], grid: Sequence[Row]) -> Claim:
    kept = [row for row in (*rows, *grid) if _keeps_precedence(row)]
    least = min(row[FOUND] for row in kept)
    return Claim(
        "A search that takes no road before all roads into its start always detects the target",
        "Section 3",
        "no horizon; both topological orders of Figure 1, the printed and the shortest "
        "optimisation, FIFO and last-in-first-out on Figure 1 and on the grid; targets that drive "
        "on or stop anywhere for good",
        "reproduced" if least >= CERTAIN else "not reproduced",
        f"The least probability of being found over {len(kept)} combinations of order, start and "
        f"targets is {least:.6f}.",
    )


def _movements(rows: Sequence[Row]) -> Claim:
    by_order = {row["order"]: row for row in rows}
    printed, shortest = by_order["optimised, as printed"], by_order["topological, shortest"]
    table = markdown_table(
        ["order on Figure 1", "roads", "extra movements", "flight of the roads and between"],
        [
            (
                name,
                str(row["roads"]),
                str(row["extra_movements"]),
                f"{row['flight_ends_s'] - row[TAKE_OFF]:,.0f} s",
            )
            for name, row in by_order.items()
        ],
    )
    fewer = shortest["extra_movements"] < printed["extra_movements"]
    return Claim(
        "An optimisation of the search order includes only two extra movements",
        "Section 3",
        "Figure 1 as this package draws it; the paper gives no lengths",
        "reproduced" if printed["extra_movements"] == PAPERS_MOVEMENTS else "not reproduced",
        f"The printed order has {printed['extra_movements']}; the least extra flight has "
        f"{shortest['extra_movements']} and keeps the precedence{', too' * (not fewer)}.",
        table,
    )


def _guarantee(rows: Sequence[Row]) -> Claim:
    lines = []
    for order in levels(rows, "order"):
        mine = [row for row in rows if row["order"] == order]
        cells = [order, str(mine[0]["extra_movements"])]
        for place in levels(rows, U0):
            here = [row for row in mine if row[U0] == place]
            ends, last = here[0]["flight_ends_s"], max(row["last_found_s"] for row in here)
            cells.append(f"{ends:,.0f} s ({last:,.0f} s)")
        lines.append(cells)
    queues = [f"topological, {name} in first out" for name in ("first", "last")]
    fifo, lifo = (next(r["flight_ends_s"] for r in rows if r["order"] == q) for q in queues)
    certain = all(row[FOUND] >= CERTAIN for row in rows if row["order"] in queues)
    places = [f"u0 = {km(place)}" for place in levels(rows, U0)]
    return Claim(
        "Q does not need to be a FIFO queue and a set may be used; in many cases this results in "
        "an unbalanced search",
        "Section 3",
        "the grid of Section 5; time at which the search is bound to have found the target, and in "
        "parentheses that at which the last of the targets tried is: at once at 0 km, where the "
        "UAV starts at the target",
        "not reproduced" if not certain else "reproduced" if lifo > fifo else "in part",
        f"{'Both find' if certain else 'Not both find'} all targets. FIFO flies until {fifo:,.0f} "
        f"s, a set that gives back what came last until {lifo:,.0f} s, from the nearest start: on "
        f"the grid the lopsided search is the {'longer' if lifo > fifo else 'shorter'} one.",
        markdown_table(["order", "extra movements", *places], lines),
    )


def _all_orders(rows: Sequence[Row]) -> Claim:
    flown, futures = levels(rows, "orders"), _several(levels(rows, "futures"))
    keys = ("target.at_sink", "uav.start.x_m")
    cases = list(dict.fromkeys(tuple(row[key] for key in keys) for row in rows))
    what = levels(rows, "what")
    value = {(*(row[key] for key in keys), row["what"]): row for row in rows}
    header = ["", *(f"{stays}, {km(-x_m)}" for stays, x_m in cases)]
    lines = []
    for name in what:
        cells = [name]
        for case in cases:
            row = value[(*case, name)]
            cells.append(f"{row[EXPECTED]:,.0f} s{_beside(row)}")
        lines.append(cells)
    return Claim(
        "7 road segments have 2^7 7! = 645,120 different search orders",
        "Section 4.1",
        f"Figure 3, {futures} futures, the sensor on all the time; the target stays at its goal or "
        "is gone; the UAV some way west of A, as the table tells",
        "reproduced" if flown == [PAPERS_ORDERS] else "not reproduced",
        f"{_several(flown)} orders are flown against all futures. In parentheses: the share of all "
        "orders that are better than the method's plan. Plans that fly a road twice are no such "
        "order, and can be better than all of them. As a check, the mean of orders drawn at random "
        f"and flown one by one is {_check(rows)} standard errors from the mean of all.",
        markdown_table(header, lines),
    )


def _several(counts: Sequence[int]) -> str:
    return " or ".join(f"{count:,}" for count in sorted(counts))


def _beside(row: Row) -> str:
    if row["standard_error_s"] is not None:
        return f" ± {row['standard_error_s']:,.0f}"
    return "" if row["what"].startswith("all") else f" ({percent(row['orders_better'], 2)})"


def _check(rows: Sequence[Row]) -> str:
    means = [row[EXPECTED] for row in rows if row["what"] == "all orders: mean"]
    drawn = [row for row in rows if row["standard_error_s"] is not None]
    apart = [
        abs(row[EXPECTED] - mean) / row["standard_error_s"]
        for row, mean in zip(drawn, means, strict=True)
    ]
    return f"{min(apart):.1f} to {max(apart):.1f}"


def _from_optimal(rows: Sequence[Row]) -> Claim:
    names = [name for name in levels(rows, "what") if name != BOUND]
    lines, gaps = [], []
    for u0_m in levels(rows, U0):
        here = {U0: u0_m}
        values = [estimate(rows, {**here, "what": name}) for name in (BOUND, *names)]
        above = [estimate(rows, {**here, "what": name}, "gap") for name in names]
        gaps.append(above[0].mean if above[0] else 0.0)
        cells = [one.seconds if one else "-" for one in values]
        shares = [one.percent if one else "-" for one in above]
        lines.append((km(u0_m), *cells, *shares))
    header = ["u0", "bound", *names, *(f"{name} above it" for name in names)]
    return Claim(
        "How far from optimal is greedy on the grid?",
        "Section 4.2",
        f"the grid of Section 5, {_several(levels(rows, 'particles'))} independent particles, "
        f"{_several([len(levels(rows, 'seed'))])} seeds, take-off after planning as the preset has "
        "it; values and bound on these particles; the bound holds for all plans over roads, either "
        "way and as often as one likes; the best of them lies between it and the best plan found",
        "beyond the paper",
        f"Greedy's plans are {100 * min(gaps):.0f} to {percent(max(gaps), 0)} above a lower bound "
        "on all plans, by distance.",
        markdown_table(header, lines),
    )


def _greedy_is_good(rows: Sequence[Row]) -> Claim:
    greedy = [row for row in rows if row["what"] == "greedy"]
    ideal = [row[EXPECTED] for row in rows if row["what"] == "all orders: best"]
    more = [row[EXPECTED] / best - 1.0 for row, best in zip(greedy, ideal, strict=True)]
    shares = [row["orders_better"] for row in greedy]
    return Claim(
        "The greedy algorithm works quite well",
        "Section 4.2",
        "its plans among all orders of Figure 3, in the cases above",
        "reproduced" if max(shares) < 0.05 else "in part",
        f"Greedy is {percent(min(more))} to {percent(max(more))} above the best order, and "
        f"{percent(min(shares), 2)} to {percent(max(shares), 2)} of all orders are better than it.",
    )
