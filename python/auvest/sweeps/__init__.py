"""Sweeps: a grid or list of parameters over a scenario or a log, on all cores or a cluster.

What is computed is kept in parts, each a Parquet file named by a digest of version, settings and
runs. What is there is not computed again: resuming after a stop, merging the parts of several
machines and adding points are the same thing.
"""

from auvest.sweeps.plan import Plan, Task, read_plan
from auvest.sweeps.result import SweepResult
from auvest.sweeps.run import sweep

__all__ = ["Plan", "SweepResult", "Task", "read_plan", "sweep"]
