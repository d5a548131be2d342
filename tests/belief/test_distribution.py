"""Quantiles against formulas that do not share code with them."""

import math
from statistics import NormalDist

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.belief.distribution import Listed, Normal, Uniform, chosen, distribution
from planner.scenario.values import DistributionSection

U = np.linspace(0, 1, 101)[:-1]


def test_uniform() -> None:
    assert Uniform(15, 25).quantile(np.array([0, 0.25, 0.5])) == pytest.approx([15, 17.5, 20])


@pytest.mark.parametrize(
    ("mean", "sd", "low", "high"),
    [
        (20, 2, 15, 25),
        (20, 2, 21, 25),
        (20, 2, 10, 19),
        (0, 1, 5, 6),
        (0, 1, -6, -5),
        (3, 50, 2, 4),
    ],
)
def test_normal_is_cut_off(mean: float, sd: float, low: float, high: float) -> None:
    values = Normal(mean, sd, low, high).quantile(U)
    assert values[0] == pytest.approx(low)
    assert np.all(np.diff(values) > 0)
    assert np.all((values >= low) & (values <= high))
    # The share below a value, by the error function of the standard library on the tail's side.
    side = 1 if low > mean else -1

    def tail(x: float) -> float:
        return math.erfc(side * (x - mean) / (sd * math.sqrt(2)))

    shares = [(tail(low) - tail(x)) / (tail(low) - tail(high)) for x in values]
    assert shares == pytest.approx(U.tolist(), abs=1e-9)


def test_wide_normal_is_not_cut() -> None:
    values = Normal(20, 2, -100, 100).quantile(U[1:])
    assert values == pytest.approx([NormalDist(20, 2).inv_cdf(u) for u in U[1:]])


def test_list_keeps_its_order_and_probabilities() -> None:
    listed = Listed(np.array([3.0, 1.0, 2.0]), np.array([0.5, 0.0, 0.5]))
    assert listed.quantile(np.array([0, 0.49999, 0.5, 0.99999])).tolist() == [3, 3, 2, 2]
    assert (listed.low, listed.high) == (2, 3)


@given(
    st.lists(st.sampled_from([0.0, 0.1, 0.3, 1.0]), min_size=1, max_size=9).filter(any),
    st.sampled_from([0.0, 0.1, 0.5, 0.9, np.nextafter(1, 0)]),
)
def test_what_has_no_probability_is_never_chosen(shares: list[float], u: float) -> None:
    probabilities = np.array(shares) / sum(shares)
    index = int(chosen(probabilities, np.array([u]))[0])
    assert probabilities[index] > 0
    assert sum(probabilities[:index]) <= u + 1e-12
    assert sum(probabilities[: index + 1]) >= u - 1e-12


@pytest.mark.parametrize(
    ("table", "at_half"),
    [
        ({"uniform": [10, 20]}, 15),
        ({"normal": {"mean": 5, "sd": 1, "low": 0, "high": 10}}, 5),
        ({"list": [1, 2, 3]}, 2),
        ({"list": [1, 2], "probabilities": [0.4, 0.6]}, 2),
        ({"constant": 7}, 7),
    ],
)
def test_tables_become_distributions(table: dict[str, object], at_half: float) -> None:
    drawn = distribution(DistributionSection.model_validate(table)).quantile(np.array([0.5]))
    assert drawn.tolist() == pytest.approx([at_half])
