"""The expert in random test mazes, through stable-baselines3's evaluation.

Run with `.venv/bin/python benchmarks/expert.py` from the repository's root; a number limits the mazes. Prints
in how many there is a plan, in how many of these the episode succeeds, and whether anything collided.
"""

from __future__ import annotations

import sys
from collections import defaultdict

import gymnasium as gym
from rich.progress import track
from stable_baselines3.common.evaluation import evaluate_policy

from hrsnake_env.random_mazes import N_TASKS
from planners.controllers import PlanningPolicy

ENV_ID = "hrsnake_env:HyperRedundantMaze-RandomTest-v0"


class Task(gym.Wrapper):
    """Start every episode in one random maze."""

    task_id = 0

    def reset(self, *, seed=None, options=None):
        """Start the task."""
        return self.env.reset(seed=seed, options={"task_id": self.task_id})


def main() -> None:
    n_tasks = int(sys.argv[1]) if len(sys.argv) > 1 else N_TASKS["test"]
    env = Task(gym.make(ENV_ID))
    policy = PlanningPolicy(env)
    counts: dict[str, int] = defaultdict(int)
    unsolved, failed = [], []
    for task_id in track(range(n_tasks), "random test mazes"):
        env.task_id = task_id
        endings: list[dict] = []
        evaluate_policy(
            policy,
            env,
            n_eval_episodes=1,
            warn=False,
            callback=lambda known, _, endings=endings: endings.append(known["info"]),
        )
        planned = policy.results[-1].motion is not None
        counts["solved"] += planned
        counts["succeeded"] += endings[-1]["is_success"]
        counts["clean"] += endings[-1]["total_collisions"] == 0 and endings[-1]["worst_impulse"] == 0.0
        if not planned:
            unsolved.append(task_id)
        elif not endings[-1]["is_success"]:
            failed.append(task_id)
    print("| mazes | with a plan | of these, success | without any collision | no plan in | no success in |")
    print("|---|---|---|---|---|---|")
    print(
        f"| {n_tasks} | {counts['solved']} | {counts['succeeded']} | {counts['clean']} "
        f"| {', '.join(map(str, unsolved)) or '-'} | {', '.join(map(str, failed)) or '-'} |"
    )


if __name__ == "__main__":
    main()
