"""What the cells of `test_campaign.py` do, in a module of its own that worker processes can import.

As a script: do the cells of a study, and say with the exit code whether all are done.
"""

import os
import signal
import sys
import time
from functools import partial
from pathlib import Path

from planners.bench.campaign import run_cells
from planners.bench.cells import Cell, CellResult, row_of
from planners.bench.tasks import Task, _rung

TASK = Task(name="fake", shape="bend", problem=partial(_rung, "bend-i60", 340.0, 565.0), n_links=5)

N_CELLS = 40

ONCE, ALWAYS, HANGS = 2, 3, 5
"""Seeds whose worker dies once, dies always, and does not come back."""


def cells_of(n_cells, *, budget=1.0):
    """Return cells that differ in their seed."""
    return [
        Cell(
            study="ladder",
            method="track",
            task=TASK,
            seed=seed,
            budget=budget,
            budget_unit="s",
            episodes=1 + seed % 3,
        )
        for seed in range(n_cells)
    ]


def quick(cell):
    """Do a cell, without planning; its rows depend on the cell alone, but for the times."""
    start = time.perf_counter()
    time.sleep(0.05)
    rows = [
        row_of(cell, None, k, status="solved", solved=True, seconds=time.perf_counter() - start)
        for k in range(cell.episodes)
    ]
    return CellResult(rows=rows, files={".npz": cell.key.encode()})


def deadly(cell):
    """Do a cell, or die; where, says the environment."""
    flag = Path(os.environ["CAMPAIGN_FLAG"])
    if cell.seed == ALWAYS or (cell.seed == ONCE and not flag.exists()):
        flag.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    if cell.seed == HANGS:
        time.sleep(600.0)
    return quick(cell)


def dies_once(cell):
    """Do a cell; the worker that meets the first of some dies."""
    return deadly(cell) if cell.seed == ONCE else quick(cell)


def on_ray(out):
    """Do the cells on a Ray cluster of two workers, which is there before and after."""
    from ray.cluster_utils import Cluster

    cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 2, "include_dashboard": False})
    try:
        return run_cells(cells_of(8), out, run=dies_once, engine="ray", address=cluster.address, quiet=True)
    finally:
        cluster.shutdown()


if __name__ == "__main__":
    # Whoever starts the tests in the background may have told them to ignore it.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    folder = Path(sys.argv[1])
    if sys.argv[2:] == ["ray"]:
        done = on_ray(folder)
    else:
        done = run_cells(cells_of(N_CELLS), folder, run=quick, workers=2, quiet=True)
    sys.exit(0 if done.complete else 130)
