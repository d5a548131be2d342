"""Write the netconvert sources of a grid of crossroads, every road directed east or south."""

import argparse
from collections.abc import Iterator, Sequence
from pathlib import Path

HEADER = (
    '<?xml version="1.0" encoding="UTF-8"?>\n'
    '<{root} xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" '
    'xsi:noNamespaceSchemaLocation="http://sumo.dlr.de/xsd/{root}_file.xsd">\n'
)
EPILOG = """\
Crossroads are named r<row>c<column>, rows count southward and columns eastward from r0c0 at
(0, 0); a road is named by its ends, r0c0-r0c1. A target that follows the roads thus goes from
the north-west corner to the south-east corner.

example: python tools/make_grid.py grid3x4 --rows 4 --columns 5 --road-m 2000
writes grid3x4/grid3x4.nod.xml and grid3x4/grid3x4.edg.xml: 20 crossroads, 31 roads of 2 km.
Put a scenario.toml beside them that names both (see sumo_nets/grid5x5) and plan on it.
"""


def nodes(rows: int, columns: int, road_m: float) -> Iterator[str]:
    """Yield one node element per crossroads, row by row."""
    for row in range(rows):
        for column in range(columns):
            # From 0 so that the first row is not at minus zero.
            x, y = column * road_m, 0 - row * road_m
            yield f'<node id="r{row}c{column}" x="{x:.10g}" y="{y:.10g}" type="unregulated"/>'


def edges(rows: int, columns: int, speed_mps: float) -> Iterator[str]:
    """Yield one edge element per road, the one to the east before the one to the south."""
    for row in range(rows):
        for column in range(columns):
            start = f"r{row}c{column}"
            for end_row, end_column in ((row, column + 1), (row + 1, column)):
                if end_row < rows and end_column < columns:
                    end = f"r{end_row}c{end_column}"
                    yield (
                        f'<edge id="{start}-{end}" from="{start}" to="{end}" numLanes="1" '
                        f'speed="{speed_mps:g}" width="0.1" spreadType="center"/>'
                    )


def write(path: Path, root: str, elements: Iterator[str]) -> None:
    """Write one source file."""
    body = "".join(f"    {element}\n" for element in elements)
    path.write_text(f"{HEADER.format(root=root)}{body}</{root}>\n", encoding="utf-8")


def arguments(argv: Sequence[str] | None) -> argparse.Namespace:
    """Return what the command line asks for."""
    parser = argparse.ArgumentParser(
        description=__doc__, epilog=EPILOG, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path, help="where to write; its name names the files")
    parser.add_argument("--rows", type=int, default=6, help="crossroads north to south (default 6)")
    parser.add_argument(
        "--columns", type=int, default=6, help="crossroads west to east (default 6)"
    )
    parser.add_argument(
        "--road-m", type=float, default=15000, help="length of a road in metres (default 15000)"
    )
    parser.add_argument(
        "--speed-mps",
        type=float,
        default=55.55,
        help="speed limit; above every drawn speed it does not bind (default 55.55)",
    )
    wanted = parser.parse_args(argv)
    if wanted.rows < 1 or wanted.columns < 1 or wanted.rows * wanted.columns < 2:
        parser.error("a grid needs at least two crossroads: raise --rows or --columns")
    if not (0.1 <= wanted.road_m < 1e7 and 0 < wanted.speed_mps < 1e4):
        parser.error("--road-m lies in 0.1 .. 10,000,000 and --speed-mps in 0 .. 10,000")
    return wanted


def main(argv: Sequence[str] | None = None) -> None:
    """Write the sources that the command line asks for."""
    wanted = arguments(argv)
    folder: Path = wanted.folder
    folder.mkdir(parents=True, exist_ok=True)
    name = folder.resolve().name
    crossroads = nodes(wanted.rows, wanted.columns, wanted.road_m)
    write(folder / f"{name}.nod.xml", "nodes", crossroads)
    roads = edges(wanted.rows, wanted.columns, wanted.speed_mps)
    write(folder / f"{name}.edg.xml", "edges", roads)
    print(f"{folder / name}.nod.xml and {name}.edg.xml: netconvert builds the network on first use")


if __name__ == "__main__":
    main()
