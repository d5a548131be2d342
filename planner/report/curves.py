"""Detection curves: the probability of having found the target, against time."""

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from planner.detection.chase import chased_by_any
from planner.detection.evaluation import Evaluation
from planner.detection.prospects import left_unseen
from planner.flight.pieces import flight_span
from planner.flight.plan import Plan
from planner.messages import percent
from planner.report.figure import in_percent
from planner.report.formats import time_unit
from planner.report.maps import TARGET_COLOUR, UAV_COLOUR, time_colours
from planner.search.problem import Problem

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MOST_OF_ALL = 0.995  # of the sightings, after which a curve is taken to have ended
LEAST_LEFT = 0.005  # of the probability; less would be written 0 %
ROOM = 1.15  # of that time
LINES: tuple[dict[str, Any], ...] = (
    {"color": UAV_COLOUR, "linestyle": (0, (4, 1.5)), "linewidth": 1.6},
    {"color": TARGET_COLOUR, "linestyle": "-", "linewidth": 2.0},
    {"color": "#009e73", "linestyle": ":", "linewidth": 2.0},
)


def shown_until_s(problem: Problem, evaluations: Iterable[Evaluation]) -> float:
    """Return when the curves have as good as ended, with some room; at the latest the horizon."""
    take_off_s = problem.flying[0].take_off_s
    ends_s = [problem.objective.by_s or 0.0, take_off_s]
    for evaluation in evaluations:
        times_s, probability = evaluation.curve()
        if len(times_s):
            enough = np.searchsorted(probability, MOST_OF_ALL * probability[-1])
            ends_s.append(float(times_s[min(int(enough), len(times_s) - 1)]))
    until_s = ROOM * max(ends_s)
    return until_s if take_off_s < until_s < problem.horizon_s else problem.horizon_s


def draw_curves(
    axes: "Axes",
    problem: Problem,
    plan: Plan,
    evaluations: Mapping[str, Evaluation],
    until_s: float,
) -> None:
    """Draw a detection curve per evaluation, the horizon, and when targets reach their goal.

    Of several targets all shares and times are those of one of them, on average.

    Parameters
    ----------
    until_s
        Where the axis of times ends.
    """
    from matplotlib.ticker import MaxNLocator

    unit, unit_s = time_unit(until_s)
    start_s = min(0.0, problem.flying[0].take_off_s)
    for line, (name, evaluation) in zip(LINES, evaluations.items(), strict=False):
        _draw_curve(axes, name, evaluation, start_s=start_s, unit_s=unit_s, **line)
    if problem.network.is_abstract:
        _draw_arrivals(axes, list(evaluations.values())[-1], until_s, unit_s)
    else:
        _draw_limits(axes, problem, next(iter(evaluations.values())), until_s, unit_s)
        axes.xaxis.set_major_locator(MaxNLocator(8, steps=[1, 2, 5, 10]))  # no halves of minutes
    label = "horizon"
    if until_s < problem.horizon_s:
        label = f"horizon: {problem.horizon_s / unit_s:,.0f} {unit}, farther right"
    axes.axvline(problem.horizon_s / unit_s, color="black", linewidth=1.2, label=label)
    if problem.objective.by_s is not None:
        line_style: Any = {"color": "#cc79a7", "linewidth": 1.6, "linestyle": "--"}
        axes.axvline(problem.objective.by_s / unit_s, label="deadline", **line_style)
    _draw_time_strip(axes, problem, plan, until_s, unit_s)
    axes.set(
        xlim=(start_s / unit_s, until_s / unit_s),
        ylim=(-0.06, 1.03),
        xlabel=f"time ({unit})",
    )
    in_percent(axes.yaxis)
    sought = problem.objective.sought
    whom = "the target" if sought == 1 else f"one of the {sought} targets, on average"
    axes.set_title(f"probability of having found {whom}", loc="left")
    axes.grid(color="#e8e8e8", linewidth=0.8)
    axes.set_axisbelow(True)
    axes.tick_params(colors="#444444", length=3)
    _put_legend(axes, evaluations, until_s)


def _put_legend(axes: "Axes", evaluations: Mapping[str, Evaluation], until_s: float) -> None:
    """Put the legend into the corner that the curves leave free, above the strip of times."""
    early = [
        e.found_by_probability(0.4 * until_s) > 0.35 * e.objective.sought
        for e in evaluations.values()
    ]
    if all(early):
        axes.legend(loc="lower right", bbox_to_anchor=(0.985, 0.05), framealpha=0.95)
    else:
        axes.legend(loc="upper left", framealpha=0.95)


def _draw_curve(
    axes: "Axes",
    name: str,
    evaluation: Evaluation,
    *,
    start_s: float,
    unit_s: float,
    **line: Any,
) -> None:
    times_s, probability = evaluation.curve()
    sought = evaluation.objective.sought
    found = evaluation.detection_probability / sought
    mean_s = evaluation.expected_detection_time_s / sought
    axes.step(
        np.concatenate(([start_s], times_s, [evaluation.objective.horizon_s])) / unit_s,
        np.concatenate(([0.0], probability / sought, [found])),
        where="post",
        label=f"{name}: {percent(found)} found, mean {mean_s:,.0f} s",
        **line,
    )


def _draw_arrivals(axes: "Axes", evaluation: Evaluation, until_s: float, unit_s: float) -> None:
    """Shade the times at which targets reach their goal, if they do so within what is shown."""
    ends_s = evaluation.end_s[np.isfinite(evaluation.end_s) & (evaluation.weight > 0)]
    if len(ends_s) and ends_s.min() < until_s:
        first, last = float(ends_s.min()), min(float(ends_s.max()), until_s)
        label = "targets reach their goal"
        axes.axvspan(first / unit_s, last / unit_s, color="#f0e442", alpha=0.25, lw=0, label=label)


def _draw_limits(
    axes: "Axes", problem: Problem, evaluated: Evaluation, until_s: float, unit_s: float
) -> None:
    """Shade what has left the map unseen, from above, and draw what no flight surpasses."""
    times_s = np.linspace(0.0, until_s, 200)
    futures, sought = problem.futures, problem.objective.sought
    left = np.array([left_unseen(futures, evaluated, time_s) for time_s in times_s.tolist()])
    left /= sought
    if left[-1] >= LEAST_LEFT:
        shade: dict[str, Any] = {"color": "#d0d0d0", "alpha": 0.6, "lw": 0}
        label = f"futures that leave the map unseen: {percent(left[-1], 0)}"
        axes.fill_between(times_s / unit_s, 1 - left, 1.0, label=label, **shade)
    at_best_s = chased_by_any(futures, problem.flying, problem.sensor)
    ceiling = float(futures.weight @ (at_best_s <= problem.horizon_s)) / sought
    if ceiling < MOST_OF_ALL:
        dots: dict[str, Any] = {"color": "black", "linewidth": 1.0, "linestyle": ":"}
        axes.axhline(
            ceiling, label=f"no flight finds more futures than {percent(ceiling, 0)}", **dots
        )


def _draw_time_strip(
    axes: "Axes", problem: Problem, plan: Plan, until_s: float, unit_s: float
) -> None:
    """Draw under the curves the colours that times have on the map."""
    first_s, last_s = flight_span(plan, problem.flying[0].take_off_s, until_s)
    if last_s > first_s:
        times_s = np.linspace(first_s, last_s, 128)
        axes.imshow(
            time_colours(times_s, problem, plan, until_s)[np.newaxis],
            extent=(first_s / unit_s, last_s / unit_s, -0.06, -0.025),
            aspect="auto",
            zorder=2,
        )
