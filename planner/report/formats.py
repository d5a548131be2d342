"""Times and lengths as people read them."""


def time_unit(longest_s: float) -> tuple[str, float]:
    """Return the unit in which times up to the given one are shown, and its seconds."""
    return ("min", 60.0) if longest_s >= 1200 else ("s", 1.0)


def length(metres: float) -> str:
    """Return a length in metres below a kilometre, else in kilometres to three digits."""
    if metres < 999.5:
        return f"{metres:.0f} m"
    return f"{metres / 1000:,.0f} km" if metres >= 1e6 else f"{metres / 1000:.3g} km"


def km(metres: float) -> str:
    """Return a length in whole kilometres."""
    return f"{metres / 1000:.0f} km"
