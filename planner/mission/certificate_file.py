"""The files of a certificate: all that somebody needs to check it without this program."""

import json
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from planner.bounds.certificate import Certificate
from planner.bounds.kernels.hops import Motion, Pieces
from planner.bounds.movements import pieces_of
from planner.files import write_json
from planner.parquet import nested, write_table
from planner.search.problem import Problem

PRICES, WEIGHTS, MOTION, NET = "prices.parquet", "weights.parquet", "motion.parquet", "net.json"
PROOF = (PRICES, WEIGHTS, MOTION, NET)
OF_SETS = ("true_optimum_limit", "sets")  # what other sets of particles tell
SAME = ("particles", "plan_class", "transit", "speed_mps", "landing_s")
LONGEST_S = 60.0  # of a piece of motion: of short ones it is seen at once that nobody is near


def certificate_content(problem: Problem, certificate: Certificate) -> dict[str, Any]:
    """Return what ``plan.json`` says of a certificate, as plain data."""
    uav, by_s = problem.uav, problem.objective.by_s
    bound = {"lower_bound_s" if by_s is None else "upper_bound_probability": certificate.bound}
    return {
        **bound,
        "gap": certificate.gap if np.isfinite(certificate.gap) else None,
        "particles": len(problem.futures),
        "plan_class": certificate.plan_class,
        "transit": problem.sensor.detects_in_transit,
        "bin_s": certificate.bin_s,
        "speed_mps": uav.speed_mps,
        "landing_s": uav.landing_s if np.isfinite(uav.landing_s) else None,
    }


def write_certificate(
    folder: Path,
    problem: Problem,
    certificate: Certificate,
    plan_file: Path,
    content: dict[str, Any],
) -> None:
    """Write prices, particles and net, and the plan with its certificate."""
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


def stored_certificate(plan_file: Path) -> dict[str, Any]:
    """Return what ``plan.json`` says of a certificate; nothing if it has none."""
    found = json.loads(plan_file.read_text(encoding="utf-8")).get("certificate")
    return found if isinstance(found, dict) else {}


def proves_more(earlier: Mapping[str, Any], new: Mapping[str, Any]) -> bool:
    """Tell whether an earlier certificate has the better bound on the same plans and particles."""
    if any(earlier.get(key) != new[key] for key in SAME):
        return False
    before, now = earlier.get("gap"), new["gap"]
    return before is not None and (now is None or before < now)


def keep_proof(folder: Path, plan_file: Path, content: Mapping[str, Any]) -> None:
    """Copy an earlier certificate's files, and write the plan with what it is told."""
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
