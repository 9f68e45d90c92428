"""Where realizations are simulated: threads at home, the processes of a pool, a Dask cluster.

A runner prepares a study and runs its realizations; `simulate` knows nothing else of it. Threads
share the study. Everywhere else it is sent once to each worker, and realizations come back in
batches, as they are finished.
"""

from ccwsim.run.executors.choosing import runner_of
from ccwsim.run.executors.cluster import connect
from ccwsim.run.executors.runner import Runner, Take, Work

__all__ = ["Runner", "Take", "Work", "connect", "runner_of"]
