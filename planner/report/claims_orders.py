"""Claims of Sections 3 and 4 on orders of roads: what is bound to find, and what is best."""

from collections.abc import Iterator, Sequence

from planner.report.claims import Claim, Found, markdown_table
from planner.report.estimates import EXPECTED, FOUND, Row, levels

TAKE_OFF, TRANSIT, PLACE = "uav.take_off_s", "sensor.detects_in_transit", "uav.start.distance_m"
CERTAIN = 1.0 - 1e-9


def claims(found: Found) -> Iterator[Claim]:
    """Yield what the studies of orders say of the paper's claims."""
    if "section3" in found:
        rows = _sound(found["section3"].rows)
        yield _breadth_first(rows)
        yield _precedence(rows, _sound(found["guarantee"].rows) if "guarantee" in found else [])
        yield _movements(rows)
    if "guarantee" in found:
        yield _guarantee(_sound(found["guarantee"].rows))
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
                    cells.append(f"{max(some):.1%}")
                    missed = max(missed, *some)
        lines.append(cells)
    return Claim(
        "Breadth-first search sometimes fails to detect the target",
        "Section 3",
        "Figure 1, no horizon; targets that drive to G or stop on the way, the worse of the two; "
        "the sensor on along roads only, or between them as well",
        "reproduced" if missed > 0 else "not reproduced",
        f"Up to {missed:.1%} of the targets are missed for ever. The text's rule leaves out ED "
        "alone; the printed list lacks DF as well.",
        markdown_table(
            ["take-off", "rule, roads only", "rule, always on", "printed, roads", "printed, on"],
            lines,
        ),
    )


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
        "beyond the paper" if fewer else "reproduced",
        f"The printed order has {printed['extra_movements']}; the least extra flight has "
        f"{shortest['extra_movements']} and keeps the precedence.",
        table,
    )


def _guarantee(rows: Sequence[Row]) -> Claim:
    lines = []
    for order in levels(rows, "order"):
        mine = [row for row in rows if row["order"] == order]
        cells = [order, str(mine[0]["extra_movements"])]
        for place in levels(rows, PLACE):
            here = [row for row in mine if row[PLACE] == place]
            ends, last = here[0]["flight_ends_s"], max(row["last_found_s"] for row in here)
            cells.append(f"{ends:,.0f} s ({last:,.0f} s)")
        lines.append(cells)
    queues = [f"topological, {name} in first out" for name in ("first", "last")]
    fifo, lifo = (next(r["flight_ends_s"] for r in rows if r["order"] == q) for q in queues)
    certain = all(row[FOUND] >= CERTAIN for row in rows if row["order"] in queues)
    places = [f"u0 = {place / 1000:.0f} km" for place in levels(rows, PLACE)]
    return Claim(
        "Q does not need to be a FIFO queue and a set may be used; in many cases this results in "
        "an unbalanced search",
        "Section 3",
        "the grid of Section 5; time at which the search is bound to have found the target, and in "
        "parentheses that at which the last of the targets tried is",
        "not reproduced" if not certain else "reproduced" if lifo > fifo else "in part",
        f"{'Both find' if certain else 'Not both find'} all targets. FIFO flies until {fifo:,.0f} "
        f"s, a set that gives back what came last until {lifo:,.0f} s, from the nearest start: on "
        f"the grid the lopsided search is the {'longer' if lifo > fifo else 'shorter'} one.",
        markdown_table(["order", "extra movements", *places], lines),
    )


def _all_orders(rows: Sequence[Row]) -> Claim:
    flown = {row["orders"] for row in rows}
    keys = ("target.at_sink", "uav.start.x_m")
    cases = list(dict.fromkeys(tuple(row[key] for key in keys) for row in rows))
    what = levels(rows, "what")
    value = {(*(row[key] for key in keys), row["what"]): row for row in rows}
    header = ["", *(f"{stays}, {-x_m / 1000:.0f} km" for stays, x_m in cases)]
    lines = []
    for name in what:
        cells = [name]
        for case in cases:
            row = value[(*case, name)]
            extra = "" if name.startswith(("all", "500")) else f" ({row['orders_better']:.2%})"
            cells.append(f"{row[EXPECTED]:,.0f} s{extra}")
        lines.append(cells)
    return Claim(
        "7 road segments have 2^7 7! = 645,120 different search orders",
        "Section 4.1",
        "Figure 3, all 100 futures, horizon 3,600 s, the sensor on all the time; the target stays "
        "at its goal or is gone; UAV 30 or 60 km west of A",
        "reproduced" if flown == {645_120} else "not reproduced",
        "All of them are flown against all futures. In parentheses: the share of all orders that "
        "are better than the method's plan. Plans that fly a road twice are no such order, and "
        "can be better than all of them.",
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
        "its plans among all orders of Figure 3, in the four cases above",
        "reproduced" if max(shares) < 0.05 else "in part",
        f"Greedy is {min(more):.1%} to {max(more):.1%} above the best order, and "
        f"{min(shares):.2%} to {max(shares):.2%} of all orders are better than it.",
    )
