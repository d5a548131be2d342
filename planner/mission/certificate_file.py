"""The files of a certificate: all that somebody needs to check it without this program."""

import json
import shutil
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from planner.bounds.certificate import Certificate
from planner.bounds.kernels.hops import Motion, Pieces
from planner.bounds.movements import pieces_of
from planner.errors import InputError
from planner.files import write_json
from planner.parquet import nested, write_table
from planner.search.problem import Problem

PRICES, WEIGHTS, MOTION, NET = "prices.parquet", "weights.parquet", "motion.parquet", "net.json"
PROOF = (PRICES, WEIGHTS, MOTION, NET)
ABSENT = ("lower_bound_s", "upper_bound_probability", "true_optimum_limit", "sets")  # if None
SAME = ("particles", "plan_class", "transit", "speed_mps", "landing_s")  # where bounds compare
OfSets = tuple[float, int]  # the true optimum's limit, and from how many sets it is
LONGEST_S = 60.0  # of a piece of motion: short ones are quickly seen to be out of reach


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
    speed_mps: float
    landing_s: float | None  # None: the UAV need not land
    true_optimum_limit: float | None = None  # these two only if other sets were asked for
    sets: int | None = None

    def __post_init__(self) -> None:
        bounds = [self.lower_bound_s, self.upper_bound_probability]
        if bounds.count(None) != 1 or not np.isfinite(self.bound):
            raise ValueError("it needs one bound, a number")

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


def stored_certificate(problem: Problem, certificate: Certificate) -> StoredCertificate:
    """Return what ``plan.json`` says of a certificate."""
    by_s, landing_s = problem.objective.by_s, problem.uav.landing_s
    return StoredCertificate(
        lower_bound_s=certificate.bound if by_s is None else None,
        upper_bound_probability=None if by_s is None else certificate.bound,
        gap=certificate.gap if np.isfinite(certificate.gap) else None,
        particles=len(problem.futures),
        plan_class=certificate.plan_class,
        transit=problem.sensor.detects_in_transit,
        bin_s=certificate.bin_s,
        speed_mps=problem.uav.speed_mps,
        landing_s=landing_s if np.isfinite(landing_s) else None,
    )


def read_certificate(plan_file: Path) -> StoredCertificate | None:
    """Return the certificate in a ``plan.json``; None if it has none.

    Raises
    ------
    InputError
        If it is broken.
    """
    found = json.loads(plan_file.read_text(encoding="utf-8")).get("certificate")
    if found is None:
        return None
    names = {field.name for field in fields(StoredCertificate)}
    try:
        return StoredCertificate(**{key: found[key] for key in found if key in names})
    except (TypeError, ValueError) as error:
        raise InputError(
            f"{plan_file}: its certificate is broken ({error}); "
            f"`planner certify {plan_file.parent} --force` makes a new one"
        ) from error


def certificate_content(problem: Problem, certificate: Certificate) -> dict[str, Any]:
    """Return what ``plan.json`` says of a certificate, as plain data."""
    return stored_certificate(problem, certificate).content()


def write_better(
    folder: Path,
    plan_file: Path,
    problem: Problem,
    certificate: Certificate,
    of_sets: OfSets | None = None,
) -> tuple[StoredCertificate, bool]:
    """Write a plan's certificate, or the earlier one again if that proves more.

    Parameters
    ----------
    of_sets
        What other sets of particles tell; what the earlier certificate has if not given.

    Returns
    -------
    tuple
        The certificate written, and whether it is the earlier one.
    """
    new, earlier = stored_certificate(problem, certificate), None
    with suppress(InputError):  # one that is broken is replaced
        earlier = read_certificate(plan_file)
    best = earlier if earlier is not None and earlier.proves_more(new) else new
    if of_sets is None and earlier is not None:
        of_sets = earlier.of_sets
    limit, sets = of_sets or (None, None)
    stays = replace(best, true_optimum_limit=limit, sets=sets)
    if best is earlier:
        keep_proof(folder, plan_file, stays.content())
    else:
        write_certificate(folder, problem, certificate, plan_file, stays.content())
    return stays, best is earlier


def write_certificate(
    folder: Path,
    problem: Problem,
    certificate: Certificate,
    plan_file: Path,
    content: dict[str, Any],
) -> None:
    """Write prices, particles and net, and the plan with its certificate as plain data."""
    futures = problem.futures
    proof = sorted(certificate.proof.items())
    prices = {
        "flight": nested([prefix for prefix, _ in proof], "int64"),
        "price": nested([price for _, price in proof], "float64"),
    }
    write_table(folder / PRICES, prices, {"unit": "reward"})
    write_table(folder / WEIGHTS, {"weight": futures.weight}, {})
    pieces = _short(pieces_of(futures))
    motion = {"particle": pieces.particle, **pieces.motion._asdict()}
    write_table(folder / MOTION, motion, {})
    write_json(folder / NET, net_content(problem))
    plan = json.loads(plan_file.read_text(encoding="utf-8"))
    write_json(folder / plan_file.name, plan | {"certificate": content})


def keep_proof(folder: Path, plan_file: Path, content: Mapping[str, Any]) -> None:
    """Copy an earlier certificate's files, and write the plan with that certificate."""
    for name in PROOF:
        shutil.copy(plan_file.with_name(name), folder / name)
    plan = json.loads(plan_file.read_text(encoding="utf-8"))
    write_json(folder / plan_file.name, plan | {"certificate": dict(content)})


def _short(pieces: Pieces) -> Pieces:
    """Return pieces of motion cut into equal parts of at most ``LONGEST_S``; rests are not cut."""
    motion = pieces.motion
    lasts_s = np.where(np.isfinite(motion.to_s), motion.to_s - motion.from_s, 0.0)
    counts = np.maximum(1, np.ceil(lasts_s / LONGEST_S).astype(int))
    whole = np.repeat(np.arange(len(counts)), counts)
    part = np.arange(len(whole)) - np.repeat(np.cumsum(counts) - counts, counts)
    parts, step_s = Motion(*(column[whole] for column in motion)), (lasts_s / counts)[whole]
    after_s = part * step_s
    from_s = parts.from_s + after_s
    cut = parts._replace(
        from_s=from_s,
        to_s=np.where(part + 1 < counts[whole], from_s + step_s, parts.to_s),
        x_m=parts.x_m + parts.vx_mps * after_s,
        y_m=parts.y_m + parts.vy_mps * after_s,
    )
    return Pieces(cut, pieces.particle[whole])


def net_content(problem: Problem) -> dict[str, Any]:
    """Return the net's nodes, and its roads each way: from, to, points, as plain data, metres."""
    net, roads = problem.network, []
    for road in range(len(net.road_ids)):
        a, b, shape = int(net.road_from[road]), int(net.road_to[road]), net.shape(road).tolist()
        roads += [(a, b, shape), (b, a, shape[::-1])]
    return {"node_xy_m": net.node_xy_m.tolist(), "roads": roads}
