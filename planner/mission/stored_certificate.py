"""What ``plan.json`` says of a certificate."""

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from planner.bounds.certificate import Certificate, gap_of
from planner.flight.uav import Uav
from planner.search.problem import Problem

ABSENT = (  # if None
    "rate_per_s",
    "uavs",
    "lower_bound_s",
    "upper_bound_probability",
    "computed_bound",
    "computed_gap",
    "true_optimum_limit",
    "sets",
)
# Where bounds compare.
SAME = ("particles", "plan_class", "transit", "speed_mps", "landing_s", "uavs")
OF_UAV = ("take_off_s", "x_m", "y_m", "speed_mps", "landing_s")
OfSets = tuple[float, int]  # the true optimum's limit, and from how many sets it is


@dataclass(frozen=True, kw_only=True)
class StoredCertificate:
    """What ``plan.json`` says of a certificate; its fields are the file's keys."""

    lower_bound_s: float | None = None  # of these two bounds there is one, by the objective
    upper_bound_probability: float | None = None
    gap: float | None  # None: infinite
    particles: int
    plan_class: str
    transit: bool
    bin_s: float
    speed_mps: float  # over ground, at most
    landing_s: float | None  # None: the UAV need not land
    rate_per_s: float | None = None  # of the sensor that the prices are for; None: misses nobody
    # of a fleet: ``OF_UAV`` of each UAV that may fly, its landing None if it need not land
    uavs: list[dict[str, float | None]] | None = None
    computed_bound: float | None = None  # these two only of free plans: a bound that files do not
    computed_gap: float | None = None  # prove, in units of the other one
    true_optimum_limit: float | None = None  # these two only if other sets were asked for
    sets: int | None = None

    def __post_init__(self) -> None:
        bounds = [self.lower_bound_s, self.upper_bound_probability]
        if bounds.count(None) != 1:
            raise ValueError("it needs one bound, a number")
        for key in ("particles", "bin_s", "speed_mps"):
            _check_number(key, getattr(self, key))
        for key in (*ABSENT, "gap", "landing_s"):
            if key != "uavs" and getattr(self, key) is not None:
                _check_number(key, getattr(self, key))
        if self.plan_class not in ("roads", "free") or not isinstance(self.transit, bool):
            raise ValueError("it needs a plan_class, roads or free, and transit, true or false")
        for uav in self.uavs or ():
            for key in OF_UAV:
                if key != "landing_s" or uav[key] is not None:
                    _check_number(key, uav[key])

    @property
    def bound(self) -> float:
        """No plan's figure is better: seconds, or a probability."""
        bound = self.upper_bound_probability if self.lower_bound_s is None else self.lower_bound_s
        assert bound is not None
        return float(bound)

    @property
    def of_sets(self) -> OfSets | None:
        """What other sets of particles tell, if they were asked."""
        if self.true_optimum_limit is None or self.sets is None:
            return None
        return self.true_optimum_limit, self.sets

    def content(self) -> dict[str, Any]:
        """Return it as plain data."""
        found = asdict(self)
        return {key: found[key] for key in found if found[key] is not None or key not in ABSENT}

    def proves_more(self, other: "StoredCertificate") -> bool:
        """Tell whether its bound is better than another one's on the same plans and particles."""
        if any(getattr(self, key) != getattr(other, key) for key in SAME):
            return False
        return self.gap is not None and (other.gap is None or self.gap < other.gap)


def _check_number(key: str, value: Any) -> None:
    if type(value) not in (int, float) or not np.isfinite(value):
        raise ValueError(f"{key} should be a number")


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None


def _of_uav(uav: Uav) -> dict[str, float | None]:
    speed_mps, landing_s = uav.fastest.speed_mps, _finite(uav.landing_s)
    return dict(zip(OF_UAV, (uav.take_off_s, uav.x_m, uav.y_m, speed_mps, landing_s), strict=True))


def stored_certificate(problem: Problem, certificate: Certificate) -> StoredCertificate:
    """Return what ``plan.json`` says of a certificate: the bound that its files prove."""
    by_s, rate_per_s = problem.objective.by_s, certificate.rate_per_s
    proven, is_free = certificate.proven, certificate.physics is not None
    gap, computed_gap = gap_of(certificate.value, proven), certificate.gap
    return StoredCertificate(
        lower_bound_s=proven if by_s is None else None,
        upper_bound_probability=None if by_s is None else proven,
        gap=_finite(gap),
        particles=len(problem.futures),
        plan_class=certificate.plan_class,
        transit=problem.sensor.detects_in_transit,
        bin_s=certificate.bin_s,
        speed_mps=problem.uav.fastest.speed_mps,
        landing_s=_finite(problem.uav.landing_s),
        rate_per_s=_finite(rate_per_s),
        uavs=[_of_uav(uav) for uav in problem.uavs] if problem.others else None,
        computed_bound=certificate.bound if is_free else None,
        computed_gap=computed_gap if is_free and np.isfinite(computed_gap) else None,
    )
