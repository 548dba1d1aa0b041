"""Logs of vehicles: bags of ROS and ArduSub read (`bags`), trials written as MCAP (`mcap_out`), a vehicle's parameters found from
its motion (`identify`), the table that they share (`motion`). The core of the package imports none of it.

    from turbidock.logs import identify, read_bag

    read_bag("dive.mcap", "dive.yaml").save("dive")
    print(identify.fit("dive/motion.csv", "pool_active"))
"""

from typing import TYPE_CHECKING, Any

from .._program import of_extra

if TYPE_CHECKING:
    from .bags import Bag as Bag, estimate_bag as estimate_bag, read_bag as read_bag
    from .mcap_out import to_mcap as to_mcap
else:

    def __getattr__(name: str) -> Any:  # what needs the extra `logs`
        modules = {"Bag": "bags", "estimate_bag": "bags", "read_bag": "bags", "to_mcap": "mcap_out"}
        if name not in modules:
            raise AttributeError(f"turbidock.logs has no {name}")
        return getattr(of_extra(f"logs.{modules[name]}", "logs"), name)
