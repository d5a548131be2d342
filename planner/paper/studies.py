"""What a condition of the paper may run in place of a method, by name."""

from planner.experiments.run_condition import Studies
from planner.paper.online import online_of
from planner.paper.optimum import optimum_of
from planner.paper.orders import orders_of
from planner.paper.precedence import precedence_of

STUDIES: Studies = {
    "orders": orders_of,
    "precedence": precedence_of,
    "optimum": optimum_of,
    "online": online_of,
}
