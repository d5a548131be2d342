"""The files of a certificate: all that somebody needs to check it without this program."""

import hashlib
import operator
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from planner.arrays import Floats
from planner.bounds.certificate import Certificate, gap_of, proven_bound
from planner.bounds.fleet_prices import fitting_bin_s
from planner.bounds.flights import Prefix
from planner.bounds.kernels.meetings import Motion, Pieces
from planner.bounds.movements import pieces_of
from planner.errors import InputError, NotApplicableError
from planner.files import json_text, write_json
from planner.futures.futures import Futures
from planner.guard import read_json
from planner.mission.stored_certificate import (
    SAME,
    OfSets,
    StoredCertificate,
    stored_certificate,
)
from planner.network.road_network import RoadNetwork
from planner.parquet import column, nested, read_table, write_table
from planner.search.problem import Problem

PRICES, WEIGHTS, MOTION, NET = "prices.parquet", "weights.parquet", "motion.parquet", "net.json"
PROOF = (PRICES, WEIGHTS, MOTION, NET)
ROUNDING = 1e-9  # by which figures worked out again may differ, as a share
LONGEST_S = 60.0  # of a piece of motion: short ones are quickly seen to be out of reach


def read_certificate(plan_file: Path) -> StoredCertificate | None:
    """Return the certificate in a ``plan.json``; None if it has none.

    Raises
    ------
    InputError
        If it is broken.
    """
    plan = read_json(plan_file)
    found = plan.get("certificate") if isinstance(plan, dict) else None
    if found is None:
        return None
    names = {field.name for field in fields(StoredCertificate)}
    try:
        return StoredCertificate(**{key: found[key] for key in found if key in names})
    except (KeyError, TypeError, ValueError) as error:
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
    new = stored_certificate(problem, certificate)
    earlier, proof = _earlier(problem, plan_file, new, certificate.value)
    stays_earlier = earlier is not None and earlier.proves_more(new)
    best = earlier if earlier is not None and stays_earlier else new
    if of_sets is None and earlier is not None:
        of_sets = earlier.of_sets
    limit, sets = of_sets or (None, None)
    stays = replace(best, true_optimum_limit=limit, sets=sets)
    written = replace(certificate, proof=proof) if stays_earlier else certificate
    write_certificate(folder, problem, written, plan_file, stays.content())
    return stays, stays_earlier


def _earlier(
    problem: Problem, plan_file: Path, new: StoredCertificate, value: float
) -> tuple[StoredCertificate | None, Mapping[Prefix, Floats]]:
    """Return an earlier certificate of the same plan and its prices; None if it does not hold."""
    earlier = None
    with suppress(InputError):  # one that is broken is replaced
        earlier = read_certificate(plan_file)
    is_of_use = earlier is not None and (earlier.proves_more(new) or earlier.of_sets)
    if earlier is None or not is_of_use or earlier.plan_class != new.plan_class:
        return None, {}
    gap = gap_of(value, earlier.bound)
    if not np.isclose(
        np.inf if earlier.gap is None else earlier.gap, gap, rtol=ROUNDING, atol=ROUNDING
    ):
        return None, {}
    proof = proof_of(earlier, plan_file, problem)
    return (None, {}) if proof is None else (earlier, proof)


def write_certificate(
    folder: Path,
    problem: Problem,
    certificate: Certificate,
    plan_file: Path,
    content: dict[str, Any],
) -> None:
    """Write prices, particles and net, and the plan with its certificate as plain data."""
    futures, credit = problem.futures, problem.network.credit
    proof = sorted(certificate.proof.items())
    prices = {
        "flight": nested([prefix for prefix, _ in proof], "int64"),
        "price": nested([price for _, price in proof], "float64"),
    }
    write_table(folder / PRICES, prices, {"unit": "reward", **credit})
    write_table(folder / WEIGHTS, {"weight": futures.weight}, credit)
    write_table(folder / MOTION, _motion_columns(futures), credit)
    write_json(folder / NET, net_content(problem.network))
    plan = read_json(plan_file)
    write_json(folder / plan_file.name, plan | {"certificate": content})


def proof_of(
    stored: StoredCertificate, plan_file: Path, problem: Problem
) -> Mapping[Prefix, Floats] | None:
    """Return the prices beside a plan that prove what its certificate says; None if none do.

    Nothing of the certificate is believed: its bound is worked out again.
    """
    of_problem = stored_certificate(problem, Certificate(0.0, 0.0, stored.plan_class))
    if not all(getattr(stored, key) == getattr(of_problem, key) for key in SAME):
        return None
    if stored.plan_class == "roads" and stored.bin_s != fitting_bin_s(problem):
        return None
    try:
        proof = read_prices(plan_file.with_name(PRICES), len(problem.futures))
        rate_per_s = np.inf if stored.rate_per_s is None else stored.rate_per_s
        certificate = Certificate(
            0.0, stored.bound, stored.plan_class, stored.bin_s, proof, rate_per_s=rate_per_s
        )
        proven = proven_bound(problem, certificate)
    except (InputError, NotApplicableError):
        return None
    slack = ROUNDING * max(1.0, problem.objective.most)
    too_much = problem.objective.is_better(proven, stored.bound) and abs(proven - stored.bound)
    return None if too_much > slack else proof


def read_prices(path: Path, particles: int) -> dict[Prefix, Floats]:
    """Return the prices of a certificate by prefix, (N,) each.

    Raises
    ------
    InputError
        If the file is missing or broken, or holds prices of another number of particles.
    """
    table = read_table(path)
    flights, prices = (column(path, table, name).to_pylist() for name in ("flight", "price"))
    try:
        proof = {
            tuple(map(operator.index, flight)): np.array(price, dtype=np.float64)
            for flight, price in zip(flights, prices, strict=True)
        }
    except (TypeError, ValueError) as error:
        raise InputError(f"{path}: holds no prices ({error})") from error
    if len(proof) < len(flights) or any(own.shape != (particles,) for own in proof.values()):
        raise InputError(f"{path}: should hold a price for each of {particles} particles")
    return proof


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


def _motion_columns(futures: Futures) -> dict[str, Any]:
    pieces = _short(pieces_of(futures))
    return {"particle": pieces.particle, **pieces.motion._asdict()}


def sha256_of_motion(futures: Futures) -> str:
    """Return the SHA-256 of motion and weights as a certificate holds them, in hexadecimal.

    Of the columns one after the other, 8 bytes a number, the lowest byte first.
    """
    digest = hashlib.sha256()
    for values in (*_motion_columns(futures).values(), futures.weight):
        digest.update(values.astype(values.dtype.newbyteorder("<")).tobytes())
    return digest.hexdigest()


def sha256_of_net(net: RoadNetwork) -> str:
    """Return the SHA-256 of the ``net.json`` that a certificate leaves, in hexadecimal."""
    return hashlib.sha256(json_text(net_content(net)).encode()).hexdigest()


def net_content(net: RoadNetwork) -> dict[str, Any]:
    """Return the net's nodes, and its roads each way: from, to, points, as plain data, metres."""
    roads = []
    for road in range(len(net.road_ids)):
        a, b, shape = int(net.road_from[road]), int(net.road_to[road]), net.shape(road).tolist()
        roads += [(a, b, shape), (b, a, shape[::-1])]
    return {**net.credit, "node_xy_m": net.node_xy_m.tolist(), "roads": roads}
