"""`planner serve`: the page as an instrument, for a call by tapping the map."""

import argparse
import ipaddress
import signal
from contextlib import closing
from pathlib import Path

from planner.cli.arguments import add_jobs, add_permit, add_settings, count, path
from planner.cli.printing import console, print_json

SUMMARY = "serve the page as an instrument: tap the map, plan, take the files"
DETAILS = """\
Serves one page to a browser on this computer and prints its link, which opens
once. Tap the map where the target was last seen, drag from there which way it
drove, say the rest, and plan: what `planner now` prints shows as it comes, and
the page is that of the best plan so far. Its files can be taken from there, and
each run stays in a folder of its own in DIR. Ctrl-C ends the server and what it
is planning.

--bind lets another device in, such as the phone in the same car, if it is given
the address of this computer in their network. Whoever has the link can plan on
this computer and see its runs. Nothing is encrypted: whoever listens on that
network sees all of it, the link too. Use it on a network that is your own."""
EXAMPLES = (
    ("serve berlin", "on this computer alone"),
    ("serve town.osm -o runs/today --port 8018", "always the same address"),
    ("serve town.osm --bind 192.168.43.7", "for a phone as well"),
)
HOME = "127.0.0.1"
OPEN_TO_ALL = (
    "other devices of this network reach it: whoever has the link can plan here, and whoever "
    "listens on the network sees all of it, as nothing is encrypted"
)


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `planner serve`."""
    parser.add_argument(
        "net",
        nargs="?",
        default="berlin",
        metavar="NET",
        help="a .net.xml, a .sumocfg or an OpenStreetMap file; or a scenario, whose net, airspace "
        "and sensor are taken (default: %(default)s)",
    )
    parser.add_argument(
        "-o",
        "--output",
        type=path,
        default=Path("runs"),
        metavar="DIR",
        help="folder for the folders of runs (default: %(default)s)",
    )
    parser.add_argument(
        "--bind",
        type=_address,
        default=HOME,
        metavar="ADDRESS",
        help="this computer's address in the network whose devices may come (default: none may)",
    )
    parser.add_argument(
        "--port", type=count, default=0, metavar="N", help="where it listens (default: any)"
    )
    parser.add_argument(
        "--aircraft",
        type=path,
        metavar="FILE",
        help="as `planner now` takes it, for all calls (default: multicopter)",
    )
    add_settings(parser)
    add_permit(parser)
    add_jobs(parser)


def run(arguments: argparse.Namespace) -> int:
    """Serve the page until Ctrl-C."""
    from planner.cli.desk import Desk
    from planner.cli.serving import Server
    from planner.errors import OutputError
    from planner.interrupts import ended_gently
    from planner.mission.areas import airspace_over
    from planner.mission.call_net import net_of
    from planner.page.serving import page_of_net

    tables, network = net_of(arguments.net)
    airspace = airspace_over(arguments.net, tables, network)
    blank = page_of_net(network, f"Plan a search: {Path(arguments.net).name}", airspace)
    desk = Desk(arguments.net, arguments.output, options_of(arguments))
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:  # begun in the background of a script
        # Programs that are started inherit what is ignored, and could not be asked to stop.
        signal.signal(signal.SIGINT, lambda *_: None)
    out = console()

    def link(address: str) -> None:
        if arguments.json:
            print_json({"link": address})
        else:
            out.print(f"open {address}", soft_wrap=True)

    if arguments.bind != HOME and not arguments.json:
        out.print(OPEN_TO_ALL)
    try:
        server = Server((arguments.bind, arguments.port), desk, blank, link)
    except (OSError, OverflowError) as error:
        reason = getattr(error, "strerror", None) or error
        raise OutputError(
            f"{arguments.bind}:{arguments.port}: cannot listen there ({reason}); choose another "
            "--port, or another address of this computer"
        ) from error
    with server, closing(desk), ended_gently(desk.close):
        if not arguments.json:
            out.print("Ctrl-C ends it")
        server.serve_forever()
    return 0


def options_of(arguments: argparse.Namespace) -> list[str]:
    """Return the options of `planner now` for all calls."""
    once = {"aircraft": arguments.aircraft, "jobs": arguments.jobs, "control": arguments.control}
    again = {"set": arguments.set, "allow": arguments.allow}
    return [
        *(f"--{name}={value}" for name, value in once.items() if value is not None),
        *(f"--{name}={value}" for name, values in again.items() for value in values),
    ]


def _address(text: str) -> str:
    try:
        address = ipaddress.IPv4Address(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"should be an address such as {HOME}") from None
    if address.is_unspecified:
        raise argparse.ArgumentTypeError(
            "should be one address of this computer, not all of them at once"
        )
    return str(address)
