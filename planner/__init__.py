"""Plans in which order a drone flies the roads to find a vehicle soonest on average.

scenario     what a person writes about a search, checked
network      a SUMO net as columns
belief       what is known of the target; particles drawn from it
futures      the particles driven by SUMO, recorded
flight       what the drone can fly: legs, tracks, plans
detection    UAV flight against futures: who is seen when
search       road orders: planners from problem to plan
bounds       how far a plan is from the best one
mission      a plan meets the truth
export       a plan for other programs
experiments  many conditions, kept one by one
report       tables, pictures, files
paper        evidence for the article

The public names are listed in ``__init__.pyi``. Each is loaded when it is first used, as some of
them take a second; so is their list, as the command line needs none of them.
"""


def __getattr__(name):
    _attach()
    return globals()["__all__"] if name == "__all__" else globals()["__getattr__"](name)


def __dir__():
    _attach()
    return globals()["__dir__"]()


def _attach():
    """Put the functions that know the public names in the place of those above."""
    import lazy_loader

    attached = lazy_loader.attach_stub(__name__, __file__)
    globals().update(zip(("__getattr__", "__dir__", "__all__"), attached, strict=True))
