"""Points of the compass: in letters, as NE, and in words, as north-east."""

POINTS = (
    *("N", "NNE", "NE", "ENE", "E", "ESE", "SE", "SSE"),
    *("S", "SSW", "SW", "WSW", "W", "WNW", "NW", "NNW"),
)
WORDS = {"N": "north", "E": "east", "S": "south", "W": "west"}


def letters(bearing_deg: float, of: int = len(POINTS)) -> str:
    """Return the point nearest to a bearing, clockwise from north, such as "NE".

    Parameters
    ----------
    of
        How many points there are: 4, 8 or 16.
    """
    points = POINTS[:: len(POINTS) // of]
    return points[round(bearing_deg * of / 360.0) % of]


def words(bearing_deg: float, of: int = 8) -> str:
    """Return the point nearest to a bearing in words, such as "north-east"."""
    return "-".join(WORDS[letter] for letter in letters(bearing_deg, of))
