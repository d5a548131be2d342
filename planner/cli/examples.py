"""Commands to copy, as --help ends: what is typed, and what that is for."""

OF_ALL = (
    ("plan grid5x5 -o runs/first", "plan, evaluate, draw"),
    ("plan grid5x5 --gap 0.1 -o runs/near", "until it is near the best plan"),
    ("fly runs/first --targets 1000", "fly it against fresh targets"),
    ("compare grid5x5", "all methods, one table"),
    ("experiment figure8 -o runs/8", "a batch; it can be stopped"),
    ("where grid5x5 --at 0:30:00", "where the vehicle may be by then"),
    ("plan grid5x5 --set uav.start.distance_m=120000 --set uav.speed_mps=50", ""),
)

OF_COMMAND = {
    "build": (("build grid5x5 -o grid.net.xml", "the net, to open in netedit"),),
    "futures": (
        ("futures grid5x5", "how many there are"),
        ("futures grid5x5 --seed 7 -o runs/futures", "other ones, as tables"),
    ),
    "where": (
        ("where grid5x5 --at 1800", "its likely roads"),
        ("where grid5x5 --at 0:30:00 -o runs/where", "with a picture"),
    ),
    "plan": (
        ("plan grid5x5 -o runs/first", "the roads, in order"),
        ("plan grid5x5 --free -o runs/free", "it may leave the roads"),
        ("plan grid5x5 --method greedy --preset paper", "as in the paper"),
        ("plan grid5x5 --gap 0.1 -o runs/near", "until so near its bound"),
        ("plan grid5x5 --objective probability --by 0:30:00", ""),
    ),
    "fly": (
        ("fly runs/first --targets 1000", "when is each found?"),
        ('fly runs/first --route "r0c0-r0c1 r0c1-r0c2" --target-speed 20', ""),
    ),
    "certify": (
        ("certify runs/first --time-limit 60", "what a minute proves"),
        ("certify runs/first --gap 0.05", "until it is 5 % at most"),
        ("certify runs/first --sets 10 --force", "of the belief itself"),
    ),
    "compare": (
        ("compare grid5x5 -o methods.csv", "every method, as a table too"),
        ("compare grid5x5 --bound", "how near the best plan?"),
        ("compare --instances -o runs/instances", "24 frozen problems"),
    ),
    "experiment": (
        ("experiment figure8 --dry-run", "its conditions, and their time"),
        ("experiment figure8 -o runs/8 --quick", "small, to see it work"),
        ("experiment figure8 -o runs/8 --only method=greedy", ""),
        ("experiment paper -o runs/paper", "all of the paper, and a report"),
    ),
    "doctor": (("doctor", "before anything else, on a new computer"),),
}


def told(examples: tuple[tuple[str, str], ...]) -> str:
    """Return examples as lines, what they are for in a column of its own."""
    widest = max((len(typed) for typed, why in examples if why), default=0)
    lines = (f"  planner {typed:<{widest}}   {why}".rstrip() for typed, why in examples)
    return "\n".join(["examples:", *lines])
