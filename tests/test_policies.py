"""Laws of the trained policies that come with the package: they act as the committed results say."""

import importlib
from pathlib import Path

import pytest

from planners.rl.evaluate import evaluate
from planners.rl.network import NetworkPolicy
from planners.rl.settings import FIRST_SEED
from planners.rl.shipped import POLICIES, policy_path

ROWS = Path(__file__).parent.parent / "docs" / "comparison" / "ladder" / "rows.parquet"
LARGEST = 200_000
"""Bytes of a policy's file."""

SAMPLED = 4
"""So many episodes of sampled actions are run again."""


@pytest.fixture(scope="module")
def rows():
    parquet = importlib.import_module("pyarrow.parquet")
    return parquet.ParquetFile(ROWS).read(use_threads=False).to_pylist()


def test_there_is_a_policy_for_each_method_that_matters():
    methods = {NetworkPolicy.load(path).origin.method for path in POLICIES.values()}
    assert {"ppo", "ppo-planned", "sac", "tqc", "clone"} <= methods


@pytest.mark.parametrize("name", POLICIES)
def test_a_policy_is_small_and_says_where_it_comes_from(name):
    path = policy_path(name)
    policy = NetworkPolicy.load(path)
    assert path.stat().st_size < LARGEST
    assert name.endswith(policy.origin.method) and policy.origin.train_steps > 0


@pytest.mark.parametrize("name", POLICIES)
def test_a_policy_acts_as_its_rows_say(name, rows):
    policy = NetworkPolicy.load(policy_path(name))
    task, method = name.removesuffix(f"-{policy.origin.method}"), policy.origin.method
    its = [
        row for row in rows if (row["task"], row["method"], row["seed"]) == (task, method, policy.origin.seed)
    ]
    for actions, n in (("mean", 1), ("sampled", SAMPLED)):
        told = sorted((row for row in its if row["actions"] == actions), key=lambda row: row["episode"])[:n]
        seen = evaluate(policy, episodes=n, seed=FIRST_SEED, deterministic=actions == "mean")
        assert [one["success"] for one in seen] == [row["success"] for row in told]
        # The processor's own sines may differ in the last bit.
        assert [one["steps"] for one in seen] == pytest.approx([row["steps"] for row in told], rel=0.05)
        assert [one["return"] for one in seen] == pytest.approx([row["return"] for row in told], rel=0.02)


def test_a_path_is_a_path():
    assert policy_path("my/policy.npz") == Path("my/policy.npz")
