"""Where the points of a recording lie in a net, and that they are near it."""

import numpy as np

from planner.arrays import Flags, Floats
from planner.errors import InputError
from planner.network.georeference import is_georeferenced, lonlat, xy_of_lonlat
from planner.network.road_network import RoadNetwork
from planner.telemetry.log import TrackLog

FAR_M = 50_000.0  # beyond where the search is: nobody flies there to see anything here
EARTH_M = 6_371_000.0
REMEDY = "leave it out, or give the recording of this search"


def xy_of_log(log: TrackLog, network: RoadNetwork, around_m: Floats) -> Floats:
    """Return where the points of a recording are, (K, 2) metres in the net's frame.

    Degrees are taken before metres, where there are both and the net has a projection.

    Parameters
    ----------
    around_m
        (k, 2) metres, where the search takes place.

    Raises
    ------
    InputError
        If a point has no place, or one far from the search; the message names it.
    """
    degrees = np.stack([log.lon_deg, log.lat_deg], axis=1)
    metres = np.stack([log.x_m, log.y_m], axis=1)
    in_degrees, in_metres = _known(degrees), _known(metres)
    low_m, high_m = around_m.min(axis=0), around_m.max(axis=0)
    middle_m, reach_m = (low_m + high_m) / 2, float(np.hypot(*(high_m - low_m))) / 2 + FAR_M
    if in_degrees.any() and not in_metres.all():
        _refuse_unplaced(log, network)
        _refuse_missing(log, in_degrees)
    if in_degrees.all() and is_georeferenced(network):
        _refuse_far_degrees(log, degrees, lonlat(network, middle_m), reach_m)
        return _projected(log, network, degrees)
    _refuse_missing(log, in_metres)
    away_m = np.hypot(*(metres - middle_m).T)
    _refuse_far(log, away_m, reach_m, metres, "x {:g} m, y {:g} m", np.zeros(len(log), bool))
    return metres


def _projected(log: TrackLog, network: RoadNetwork, degrees: Floats) -> Floats:
    try:
        return xy_of_lonlat(network, degrees)
    except InputError as error:
        raise InputError(f"{log.path}: {error}") from error


def _known(places: Floats) -> Flags:
    return np.asarray(np.isfinite(places).all(axis=1))


def _refuse_unplaced(log: TrackLog, network: RoadNetwork) -> None:
    if not is_georeferenced(network):
        raise InputError(
            f"{log.path}: has longitude and latitude, and the net of this run does not say where "
            "on the Earth it lies; give --origin LAT,LON, the place where its x and y are 0"
        )


def _refuse_missing(log: TrackLog, known: Flags) -> None:
    if not known.all():
        raise InputError(f"{log.at(int(np.argmin(known)))}: has no place; leave it out")


def _refuse_far_degrees(log: TrackLog, degrees: Floats, middle: Floats, reach_m: float) -> None:
    lon, lat = degrees.T
    nowhere = (np.abs(lat) > 90.0) | (np.abs(lon) > 180.0)
    exchanged = _apart_m(degrees[:, ::-1], middle) <= reach_m
    away_m = np.where(nowhere, np.inf, _apart_m(degrees, middle))
    _refuse_far(log, away_m, reach_m, degrees, "longitude {:.10g}, latitude {:.10g}", exchanged)


def _refuse_far(
    log: TrackLog, away_m: Floats, reach_m: float, places: Floats, text: str, exchanged: Flags
) -> None:
    near = away_m <= reach_m
    if near.all():
        return
    k = int(np.argmin(near))
    place = text.format(*places[k].tolist())
    if exchanged[k]:
        raise InputError(
            f"{log.at(k)}: {place} is far from the search, and exchanged it would be near; "
            "exchange longitude and latitude"
        )
    away = "nowhere on the Earth" if np.isinf(away_m[k]) else f"{away_m[k] / 1000:,.0f} km away"
    raise InputError(f"{log.at(k)}: {place} is {away} from the search; {REMEDY}")


def _apart_m(degrees: Floats, middle: Floats) -> Floats:
    """Return how far places are from one, (K,) metres, on a sphere."""
    (lon, lat), (lon_0, lat_0) = np.radians(degrees).T, np.radians(middle)
    half = np.sin((lat - lat_0) / 2) ** 2
    half += np.cos(lat) * np.cos(lat_0) * np.sin((lon - lon_0) / 2) ** 2
    return np.asarray(2 * EARTH_M * np.arcsin(np.sqrt(np.clip(half, 0.0, 1.0))))
