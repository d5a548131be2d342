"""What the files of a certified run say, for verify.py: every field's type, and the run's record.

docs/formats.md has the fields. Whatever is not as it says is refused; what the files say more than
once, and the digests in run.json, are claims like others.
"""

import hashlib
import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

import numpy as np
import pyarrow
from verify_files import LARGEST, Array, Fields, RefusedError, read_columns, read_json, rows_of
from verify_uavs import Flight, Uav, flights_of, flights_said_again, misses_said_again, uavs_of

Prefix: TypeAlias = tuple[int, ...]  # the first hops of a flight; () is before take-off
Pair: TypeAlias = tuple[float, float]

SCHEMAS = {"run.json": ("planner.run/1",), "plan.json": ("planner.plan/1", "planner.plan/2")}
MOST_NODES = 2000  # of a net whose road plans are bounded
OF_MOTION = ("particle", "from_s", "to_s", "x_m", "y_m", "vx_mps", "vy_mps")
ROUNDING_S = 1e-6  # by which pieces of a motion may overlap
WHOLE, REAL = pyarrow.int64(), pyarrow.float64()
TRILLIONTH = 1e-12


class Claim(NamedTuple):
    """What the files say, and what is found."""

    name: str
    claimed: Any
    found: Any
    wrong: float  # by how much


def same(name: str, claimed: Any, found: Any) -> Claim:
    """Return the claim that two things are equal, numbers but for their rounding."""
    numbers = all(type(one) in (int, float) for one in (claimed, found))
    near = numbers and math.isclose(claimed, found, rel_tol=TRILLIONTH, abs_tol=TRILLIONTH)
    return Claim(name, claimed, found, float(not (near or claimed == found)))


@dataclass(frozen=True)
class Given:
    """What plan.json says of the problem."""

    horizon_s: float
    radius_m: float
    rate_per_s: float  # of detection within the radius; infinity: nobody is missed
    plan_class: str
    transit: bool
    bin_s: float
    bound_rate_per_s: float  # of the sensor that the prices are for
    found_by_s: float | None
    uavs: tuple[Uav, ...]

    @property
    def bound_key(self) -> str:
        """The name of the bound in the certificate."""
        return "lower_bound_s" if self.found_by_s is None else "upper_bound_probability"


@dataclass(frozen=True)
class Net:
    """Nodes, and roads each way: from, to, points."""

    node_xy_m: Array  # (nodes, 2)
    roads: list[tuple[int, int, Array]]


@dataclass(frozen=True)
class Inputs:
    """All that the files say, each of its type; what of it is true is another matter."""

    given: Given
    planned: Mapping[str, float]  # figures by name
    certificate: Mapping[str, float | None]
    unchecked: Mapping[str, Any]  # what it says of other particles
    flights: tuple[Flight, ...]
    net: Net
    motion: dict[str, Array]  # by column
    weight: Array  # (N,)
    prices: dict[Prefix, Array]
    record: tuple[Claim, ...]  # how the files agree with run.json and in themselves


def read_inputs(folder: Path) -> Inputs:
    """Return what the files of a certified run say.

    Raises
    ------
    RefusedError
        If one is missing, or a field is of another type or size than docs/formats.md says.
    """
    run, plan, net = (read_json(folder, name) for name in ("run.json", "plan.json", "net.json"))
    run.text("schema", *SCHEMAS["run.json"])
    plan.text("schema", *SCHEMAS["plan.json"])
    planned, certificate = plan.part("planned"), plan.part("certificate")
    flights = flights_of(plan)
    weight = read_columns(folder, "weights.parquet", weight=REAL)["weight"].values
    motion = _motion(folder, len(weight))
    given, roads = _given(planned, certificate, uavs_of(run, certificate, flights)), _net(net)
    if given.plan_class == "roads" and any(uav.sorties > 1 for uav in given.uavs):
        raise RefusedError("run.json: scenario: uav: no bound is for road plans of several sorties")
    if given.plan_class == "roads" and len(roads.node_xy_m) > MOST_NODES:
        raise RefusedError(f"net.json: has more than {MOST_NODES} nodes; too many to check")
    prices = _prices(folder, len(weight))
    if (() in prices) != (given.plan_class == "roads"):
        raise RefusedError(
            "prices.parquet: should hold prices before take-off, for road plans only"
        )
    if len(given.uavs) > 1 and len(prices) > 1:
        raise RefusedError("prices.parquet: of several UAVs there are none but before take-off")
    return Inputs(
        given=given,
        planned=_planned(planned),
        certificate=_certificate(certificate, given),
        unchecked=_unchecked(plan, certificate),
        flights=flights,
        net=roads,
        motion=motion,
        weight=weight,
        prices=prices,
        record=(
            *_digests(run, plan, net, motion, weight),
            *_of_scenario(run, planned, given),
            *(same(*said) for said in flights_said_again(run, plan, flights, given.uavs)),
            *_consistent(roads, motion),
        ),
    )


def _given(planned: Fields, certificate: Fields, uavs: tuple[Uav, ...]) -> Given:
    objective = planned.text("objective", "time", "probability")
    has_deadline = objective == "probability"
    for fields, key in ((planned, "found_by_s"), (planned, "found_by_probability")):
        if (key in fields) != has_deadline:
            raise RefusedError(f"{fields.where}: {key} goes with the objective probability")
    plan_class = certificate.text("plan_class", "roads", "free")
    bin_s = certificate.number("bin_s", 0.0)
    if (bin_s > 0.0) != (plan_class == "roads"):
        raise RefusedError("plan.json: certificate: bin_s is for road plans, and 0 for others")
    return Given(
        horizon_s=planned.above_zero("horizon_s"),
        radius_m=planned.above_zero("radius_m"),
        rate_per_s=_rate(planned),
        plan_class=plan_class,
        transit=certificate.flag("transit"),
        bin_s=bin_s,
        bound_rate_per_s=_rate(certificate),
        found_by_s=planned.above_zero("found_by_s") if has_deadline else None,
        uavs=uavs,
    )


def _rate(fields: Fields) -> float:
    """Return the rate of detection that is said; where none is, nobody is missed."""
    return fields.above_zero("rate_per_s") if "rate_per_s" in fields else math.inf


def _planned(planned: Fields) -> dict[str, float]:
    keys = ("expected_detection_time_s", "detection_probability", "found_by_probability")
    figures = {key: planned.number(key) for key in keys if key in planned or key != keys[2]}
    return figures | {"particles": planned.whole("particles", 1)}


def _certificate(certificate: Fields, given: Given) -> dict[str, float | None]:
    key = given.bound_key
    if {"lower_bound_s", "upper_bound_probability"} & certificate.content.keys() != {key}:
        raise RefusedError(f"{certificate.where}: should have one bound, {key}")
    bound, gap = certificate.number(key), certificate.maybe("gap", 0.0)
    return {key: bound, "gap": gap, "particles": certificate.whole("particles", 1)}


def _unchecked(plan: Fields, certificate: Fields) -> dict[str, Any]:
    plan.part("evaluated")
    found: dict[str, Any] = {}
    if ("sets" in certificate) != ("true_optimum_limit" in certificate):
        raise RefusedError(f"{certificate.where}: sets and true_optimum_limit go together")
    if "sets" in certificate:
        found["true_optimum_limit"] = certificate.number("true_optimum_limit")
        found["sets"] = certificate.whole("sets", 2)
    return found


def _net(net: Fields) -> Net:
    nodes, roads = net.rows("node_xy_m", 2, least=1), list[tuple[int, int, Array]]()
    for i, road in enumerate(net.items("roads")):
        ends = road[:2] if isinstance(road, list) and len(road) == 3 else []
        if not ends or not all(type(end) is int and 0 <= end < len(nodes) for end in ends):
            raise RefusedError(f"net.json: road {i} should be two nodes' numbers, and points")
        points = road[2] if isinstance(road[2], list) else []
        roads.append((*ends, rows_of(f"net.json: road {i}", points, 2, 2)))
    if not roads or len(roads) % 2:
        raise RefusedError("net.json: should have roads, each there and back")
    return Net(nodes, roads)


def _motion(folder: Path, particles: int) -> dict[str, Array]:
    name = "motion.parquet"
    types = {key: WHOLE if key == "particle" else REAL for key in OF_MOTION}
    motion = {key: column.values for key, column in read_columns(folder, name, **types).items()}
    finite = [np.abs(motion[key]) <= LARGEST for key in OF_MOTION if key != "to_s"]
    whose, from_s, to_s = (motion[key] for key in OF_MOTION[:3])
    if not (np.all(finite) and np.all((to_s >= from_s) & ((to_s <= LARGEST) | (to_s == np.inf)))):
        raise RefusedError(f"{name}: should hold finite numbers, and no end before its begin")
    if not np.all((whose >= 0) & (whose < particles)):
        raise RefusedError(f"{name}: a particle has no row in weights.parquet")
    moves = (motion["vx_mps"] != 0) | (motion["vy_mps"] != 0)
    if np.any(moves & (to_s == np.inf)):
        raise RefusedError(f"{name}: only a rest is without end")
    return motion


def _prices(folder: Path, particles: int) -> dict[Prefix, Array]:
    name, lists = "prices.parquet", {"flight": pyarrow.list_(WHOLE), "price": pyarrow.list_(REAL)}
    flight, price = read_columns(folder, name, **lists).values()
    assert flight.lengths is not None
    assert price.lengths is not None
    if np.any(price.lengths != particles) or not np.all(np.abs(price.values) <= LARGEST):
        raise RefusedError(f"{name}: should hold a finite price for each of {particles} particles")
    hops = np.split(flight.values, np.cumsum(flight.lengths)[:-1]) if len(flight.lengths) else []
    prices = price.values.reshape(-1, particles) if particles else []
    found = {tuple(prefix.tolist()): own for prefix, own in zip(hops, prices, strict=True)}
    if len(found) < len(hops):
        raise RefusedError(f"{name}: a flight has prices twice")
    return found


def digest_of_json(content: Any) -> str:
    """Return the SHA-256 of plain data, whatever the order of its keys, in hexadecimal."""
    text = json.dumps(content, sort_keys=True, separators=(",", ":"), ensure_ascii=False)
    return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()


def digest_of_motion(motion: Mapping[str, Array], weight: Array) -> str:
    """Return the SHA-256 of motion and weights, column by column, in hexadecimal."""
    digest = hashlib.sha256()
    for key in OF_MOTION:
        digest.update(motion[key].astype("<i8" if key == "particle" else "<f8").tobytes())
    digest.update(weight.astype("<f8").tobytes())
    return digest.hexdigest()


def _digests(
    run: Fields, plan: Fields, net: Fields, motion: Mapping[str, Array], weight: Array
) -> Iterator[Claim]:
    """Yield the digests that run.json holds beside those of the files."""
    said = run.part("sha256")
    as_planned = {key: plan.content[key] for key in plan.content if key != "certificate"}
    found = {
        "scenario": digest_of_json(run.part("scenario").content),
        "plan": digest_of_json(as_planned),
        "roads": hashlib.sha256(net.source).hexdigest(),
        "motion": digest_of_motion(motion, weight),
    }
    for key, digest in found.items():
        yield same(f"sha256 of {key}", said.text(key)[:64], digest)


def _of_scenario(run: Fields, planned: Fields, given: Given) -> Iterator[Claim]:
    """Yield what the scenario in run.json asks for beside what was planned."""
    scenario = run.part("scenario")
    search, sensor = scenario.part("search"), scenario.part("sensor")
    yield same("seed of the scenario", run.whole("seed"), search.whole("seed"))
    yield same("horizon_s of the scenario", given.horizon_s, search.number("horizon_s"))
    yield same("radius_m of the scenario", given.radius_m, sensor.number("radius_m"))
    yield same("transit of the scenario", given.transit, sensor.flag("detects_in_transit"))
    said = misses_said_again(scenario, given.rate_per_s, given.radius_m)
    yield from (same(*one) for one in said)
    worse = given.bound_rate_per_s < given.rate_per_s
    yield Claim("prices are for a sensor as good", True, not worse, float(worse))
    objective = search.text("objective")
    yield same("objective of the scenario", planned.text("objective"), objective)
    by_s = search.number("by_s") if objective == "probability" else None
    yield same("found_by_s of the scenario", given.found_by_s, by_s)


def _consistent(net: Net, motion: Mapping[str, Array]) -> Iterator[Claim]:
    """Yield what net and motion have to keep in themselves."""
    pairs = list(zip(net.roads[::2], net.roads[1::2], strict=True))
    turned = all(
        (a, b) == (d, c) and np.array_equal(there, back[::-1])
        for (a, b, there), (c, d, back) in pairs
    )
    yield Claim("each road leads there and back", True, turned, float(not turned))
    joined = all(
        np.array_equal(points[[0, -1]], net.node_xy_m[[a, b]]) for a, b, points in net.roads
    )
    yield Claim("roads begin and end at their nodes", True, joined, float(not joined))
    whose, from_s, to_s = (motion[key] for key in OF_MOTION[:3])
    order = np.lexsort((to_s, from_s, whose))
    again = np.diff(whose[order]) == 0
    late_s = np.where(again, to_s[order][:-1] - from_s[order][1:], -np.inf)
    apart = bool(np.all(late_s <= ROUNDING_S))
    yield Claim("each particle is at one place at a time", True, apart, float(not apart))
