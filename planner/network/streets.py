"""Names that people use: streets, crossings, and the edge that was meant."""

from planner.messages import suggestion
from planner.network.road_network import RoadNetwork


def no_edge(name: str, network: RoadNetwork) -> str:
    """Return what is wrong with a name that is not that of an edge for cars, and the remedy."""
    if name in network.closed_edges:
        return "is not for cars; name an edge that a car may use"
    return f"is not an edge of the network; {suggestion(name, network.edge_ids)}"
