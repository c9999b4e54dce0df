"""Laws of the wrappers: planned starts, and residuals on follow-the-leader."""

import pickle

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from hrsnake_env import ArmSpec, InputError, Maze
from hrsnake_env.ladder import LADDER
from planners import PLANNERS, plan
from planners.motion_cache import MotionCache
from planners.wrappers import ActionRepeat, PlannedResets, ResidualFollower, StepCost, follow_the_leader

TIGHT = "hrsnake_env:HyperRedundantMaze-UTurn-I80-v0"
RANDOM = "hrsnake_env:HyperRedundantMaze-RandomTrain-v0"


def id_of(name):
    return f"hrsnake_env:HyperRedundantMaze-{name}-v0"


def starts(env, n, seed=0):
    """Return waypoint and feed of n episodes from one seed on."""
    infos = [env.reset(seed=seed if k == 0 else None)[1] for k in range(n)]
    return [(info["waypoint"], info["feed"]) for info in infos]


@pytest.fixture(scope="module")
def motion():
    """Return a motion for the tight U-turn."""
    rung = LADDER["u-turn-i80"]
    return plan(Maze.load("u-turn-i80"), ArmSpec(link_length=rung.link_length, n_links=rung.n_links)).motion


def test_the_share_of_the_episodes_starts_on_the_motion(motion):
    env = PlannedResets(gym.make(TIGHT), motion, share=0.7)
    waypoints = np.array([waypoint for waypoint, _ in starts(env, 200)])
    # Four standard deviations of 200 draws are 0.13.
    assert abs((waypoints >= 0).mean() - 0.7) < 0.13
    assert len(set(waypoints[waypoints >= 0])) > 50
    assert set(waypoints[waypoints < 0]) == {-1}


@pytest.mark.parametrize(("share", "planned"), [(0.0, False), (1.0, True)])
def test_a_share_of_none_or_all_is_none_or_all(motion, share, planned):
    env = PlannedResets(gym.make(TIGHT), motion, share=share)
    assert all((waypoint >= 0) is planned for waypoint, _ in starts(env, 30))


def test_a_planned_start_is_the_waypoint_of_the_motion_and_never_at_the_goal(motion):
    env = PlannedResets(gym.make(TIGHT), motion, share=1.0)
    maze = env.unwrapped.maze
    env.reset(seed=3)
    seen = []
    for _ in range(100):
        _, info = env.reset()
        seen.append(info["waypoint"])
        np.testing.assert_allclose(
            env.unwrapped.target, [motion.feed[seen[-1]], *motion.joint_angles[seen[-1]]], atol=1e-9
        )
        assert info["tip_distance"] > maze.goal_radius and not info["success"]
    inside = np.hypot(*(motion.joints[:, -1] - maze.goal).T) <= maze.goal_radius
    assert inside.any() and max(seen) < np.argmax(inside)


def test_every_waypoint_outside_the_goal_can_be_a_start_and_no_other(motion):
    env = PlannedResets(gym.make(TIGHT), motion, share=1.0)
    env.reset(seed=0)
    start = env._start(1.0 - 1e-12)
    env.reset(options=start)
    assert start["waypoint"] + 1 < motion.n_poses
    with pytest.raises(InputError, match="outside the goal's radius"):
        env.reset(options={"motion": motion, "waypoint": start["waypoint"] + 1})
    assert env._start(0.0)["waypoint"] == 0


def test_planned_starts_keep_away_from_the_walls():
    env = PlannedResets(gym.make(TIGHT), share=1.0)
    clearances = [env.reset(seed=k)[1]["clearance"] for k in range(30)]
    assert min(clearances) > 0.019 * LADDER["u-turn-i80"].link_length


def receding_starts(env, n, success):
    """Return where n episodes start, as shares of the motion, with the ends that they are made to have."""
    places = []
    for k in range(n):
        _, info = env.reset(seed=k if k == 0 else None)
        places.append(info["waypoint"])
        if info["waypoint"] >= 0:
            env._receding.ended(success)
    return np.array(places)


def test_starts_that_recede_begin_near_the_goal_and_come_to_the_base_with_success(motion):
    env = PlannedResets(gym.make(TIGHT), motion, share=1.0, recede=True)
    last = env.reset(seed=0) and env._start(1.0 - 1e-12)["waypoint"]
    places = receding_starts(env, 20, success=False)
    assert places.min() > 0.95 * last
    places = receding_starts(env, 900, success=True)
    assert places[-100:].min() < 0.1 * last
    assert env.reset()[1]["receded"] == 1.0
    in_part = places[-100:] < 0.04 * last
    assert in_part.mean() == pytest.approx(0.6, abs=0.2)


def test_starts_that_recede_come_back_where_nothing_succeeds(motion):
    env = PlannedResets(gym.make(TIGHT), motion, share=1.0, recede=True)
    receding_starts(env, 100, success=True)
    there = env.reset()[1]["receded"]
    receding_starts(env, 60, success=False)
    assert 0.02 <= env.reset()[1]["receded"] < there


def test_all_of_the_motion_is_drawn_from_unless_starts_recede(motion):
    assert PlannedResets(gym.make(TIGHT), motion).reset(seed=0)[1]["receded"] == 1.0


def test_a_repeated_action_is_so_many_steps_and_its_reward_their_sum():
    repeated, bare = ActionRepeat(gym.make(TIGHT), 4), gym.make(TIGHT)
    repeated.reset(seed=0), bare.reset(seed=0)
    action = np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.1])
    observation, reward, *_ = repeated.step(action)
    steps = [bare.step(action) for _ in range(4)]
    np.testing.assert_array_equal(observation, steps[-1][0])
    assert reward == pytest.approx(sum(step[1] for step in steps), abs=1e-12)


def test_a_repeated_action_stops_where_the_episode_ends():
    env = ActionRepeat(gym.make(TIGHT, max_episode_steps=6), 4)
    env.reset(seed=0)
    steps = [env.step(np.zeros(6)) for _ in range(2)]
    assert [truncated for _, _, _, truncated, _ in steps] == [False, True]
    assert [info["total_steps"] for *_, info in steps] == [4, 6]


def test_a_step_costs_in_rewards_that_are_given_and_in_those_that_are_replayed():
    name = "hrsnake_env:HyperRedundantMaze-UTurn-I80-Sparse-v0"
    bare, env = (gym.make(name, observation="goal") for _ in range(2))
    env = StepCost(env, 0.25)
    bare.reset(seed=0), env.reset(seed=0)
    observation, reward, *_, info = bare.step(np.ones(6))
    _, less, *_ = env.step(np.ones(6))
    assert less == pytest.approx(reward - 0.25)
    goal = observation["achieved_goal"]
    replayed = bare.unwrapped.compute_reward(goal, goal, info)
    assert env.compute_reward(goal, goal, info) == pytest.approx(replayed - 0.25)


@pytest.mark.parametrize("cost", [-1.0, float("nan"), "1"])
def test_a_cost_that_is_no_number_from_0_on_is_refused(cost):
    with pytest.raises(InputError, match="cost"):
        StepCost(gym.make(TIGHT), cost)


@pytest.mark.parametrize("repeat", [0, -1, 1.5, "4"])
def test_a_repeat_that_is_no_count_is_refused(repeat):
    with pytest.raises(InputError, match="repeat"):
        ActionRepeat(gym.make(TIGHT), repeat)


@pytest.mark.parametrize("env_id", [TIGHT, RANDOM])
def test_a_seed_repeats_the_starts_exactly(env_id):
    first, second = (PlannedResets(gym.make(env_id)) for _ in range(2))
    second.reset(seed=5)
    drawn = starts(first, 5, seed=1)
    assert drawn == starts(second, 5, seed=1)
    assert drawn != starts(second, 5, seed=2)


def test_the_mazes_that_are_drawn_are_those_of_the_bare_environment():
    wrapped, bare = PlannedResets(gym.make(RANDOM)), gym.make(RANDOM)
    for k in range(6):
        seed = 4 if k == 0 else None
        assert wrapped.reset(seed=seed)[1]["task_id"] == bare.reset(seed=seed)[1]["task_id"]


def test_the_waypoint_is_told_from_the_reset_to_the_end(motion):
    env = PlannedResets(gym.make(TIGHT), motion, share=1.0)
    _, info = env.reset(seed=0)
    _, _, _, _, later = env.step(env.action_space.sample())
    assert info.keys() == later.keys() and later["waypoint"] == info["waypoint"] >= 0
    assert type(info["waypoint"]) is int


@pytest.mark.parametrize(
    "options",
    [{"feed": 100.0}, {"motion": "motion"}, {"motion": "motion", "waypoint": 7}, {"state": "state"}],
)
def test_starts_that_the_user_asks_for_are_untouched(motion, options):
    env = PlannedResets(gym.make(TIGHT), motion, share=1.0)
    env.reset(seed=0)
    values = {"motion": motion, "state": env.unwrapped.get_state()}
    options = {key: values.get(key, value) for key, value in options.items()}
    bare = gym.make(TIGHT)
    observation, info = env.reset(options=options)
    np.testing.assert_array_equal(observation, bare.reset(options=options)[0])
    assert info["waypoint"] == -1


def test_another_maze_or_goal_is_planned_for():
    env = PlannedResets(gym.make(TIGHT), share=1.0)
    env.reset(seed=0)
    goal = env.unwrapped.maze.goal + np.array([0.0, 60.0])
    _, info = env.reset(options={"goal": goal})
    assert info["waypoint"] >= 0
    np.testing.assert_array_equal(env.unwrapped.maze.goal, goal)


def test_without_a_plan_episodes_start_at_the_base():
    # Links of 470 px do not pass U-turns whose longest rod is 440 px.
    env = PlannedResets(
        gym.make("hrsnake_env:HyperRedundantMaze-v0", maze="fig19", link_length=470.0), share=1.0
    )
    assert starts(env, 3) == [(-1, 0.0)] * 3


def test_an_arm_too_short_for_the_motion_starts_at_the_base():
    arm = ArmSpec(link_length=352.0, n_links=2)
    assert MotionCache().motion(Maze.load("u-turn-i80"), arm) is None


def test_a_pickled_wrapper_goes_on_with_the_same_starts(motion):
    env = PlannedResets(gym.make(TIGHT), motion)
    env.reset(seed=0)
    copy = pickle.loads(pickle.dumps(env))
    assert [env.reset()[1]["waypoint"] for _ in range(10)] == [copy.reset()[1]["waypoint"] for _ in range(10)]


@pytest.mark.parametrize("wrapper", [PlannedResets, ResidualFollower])
@pytest.mark.filterwarnings("ignore:.*is different from the unwrapped version")
def test_wrapped_environments_pass_the_checker(wrapper):
    check_env(wrapper(gym.make(id_of("Bend-I30"))), skip_render_check=False)


@pytest.mark.parametrize("wrapper", [PlannedResets, ResidualFollower])
def test_wrapped_environments_run_side_by_side(wrapper):
    envs = gym.make_vec(id_of("Bend-I30"), num_envs=2, vectorization_mode="sync", wrappers=[wrapper])
    observations, infos = envs.reset(seed=1)
    assert observations.shape[0] == 2
    for _ in range(5):
        envs.step(envs.action_space.sample())
    if wrapper is PlannedResets:
        assert infos["waypoint"].shape == (2,)
    envs.close()


@pytest.mark.parametrize("wrapper", [PlannedResets, ResidualFollower])
def test_a_wrapped_environment_is_made_again_from_its_spec(wrapper):
    env = wrapper(gym.make(id_of("Bend-I30")))
    again = gym.make(env.spec)
    assert isinstance(again, wrapper)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"share": 1.5}, "Expected a share from 0 to 1, got 1.5."),
        ({"share": float("nan")}, "Expected a share from 0 to 1, got nan."),
        ({"planner": "x"}, f"Unknown planner 'x'. Available: auto, {', '.join(PLANNERS)}."),
    ],
)
def test_bad_arguments_are_told_in_one_sentence(arguments, message):
    with pytest.raises(InputError) as told:
        PlannedResets(gym.make(TIGHT), **arguments)
    assert str(told.value) == message


def test_motions_of_another_arm_or_maze_are_refused(motion):
    with pytest.raises(InputError, match="Expected a motion of links of 170 px, got one of links of 352"):
        PlannedResets(gym.make(id_of("Bend-I30")), motion)
    with pytest.raises(InputError, match="Expected at least 5 links for this motion, got 4"):
        PlannedResets(gym.make(id_of("UTurn-I80"), n_links=4), motion)


def follow(env, action, n=1000):
    """Send an action until the episode ends; return the targets and the last info."""
    env.reset(seed=0)
    targets, over, info = [], False, {}
    while not over and len(targets) < n:
        _, _, terminated, truncated, info = env.step(action)
        targets.append(env.unwrapped.target)
        over = terminated or truncated
    return np.array(targets), info


def zero_residual(env):
    return np.eye(1, *env.action_space.shape, dtype=np.float32)[0]


@pytest.mark.parametrize("mode", ["delta", "absolute"])
@pytest.mark.parametrize("name", ["Bend-I30", "UTurn-I30"])
def test_no_residual_is_the_follower_and_passes_loose_turns(name, mode):
    env = ResidualFollower(gym.make(id_of(name), action=mode))
    targets, info = follow(env, zero_residual(env))
    assert info["success"]
    feeds, angles = follow_the_leader(env.unwrapped.maze, env.unwrapped.arm)
    planned = np.array([np.interp(targets[:, 0], feeds, column) for column in angles.T]).T
    # Actions are single precision.
    np.testing.assert_allclose(targets[:, 1:], planned, atol=1e-6)


@pytest.mark.parametrize("mode", ["delta", "absolute"])
def test_a_residual_turns_the_joints_out_of_the_feeder_by_its_share_of_the_scale(mode):
    env = ResidualFollower(gym.make(id_of("Bend-I30"), action=mode), scale=0.2)
    action = zero_residual(env)
    straight, _ = follow(env, action, 70)
    action[-1] = 0.25
    turned, _ = follow(env, action, 70)
    np.testing.assert_allclose(turned[-1] - straight[-1], [0, 0, 0, 0, 0.05], atol=1e-6)


@pytest.mark.parametrize("mode", ["delta", "absolute"])
def test_the_environment_is_never_told_more_than_an_action(mode):
    env = ResidualFollower(gym.make(id_of("UTurn-I30"), action=mode, terminate_on_collision=False), scale=3.0)
    env.action_space.seed(0)
    env.reset(seed=0)
    for _ in range(200):
        action = env.action_space.sample()
        driven = env.driven(action)
        assert driven.dtype == np.float32 and env.action_space.contains(driven)
        env.step(action)


def test_no_feed_is_no_advance():
    env = ResidualFollower(gym.make(id_of("Bend-I30")))
    follow(env, zero_residual(env), 60)
    before = env.unwrapped.target
    env.step(np.zeros(env.action_space.shape, dtype=np.float32))
    np.testing.assert_allclose(env.unwrapped.target, before, atol=1e-6)


@pytest.mark.parametrize("bad", [np.zeros(3), np.full(5, np.nan)])
def test_a_bad_action_is_refused(bad):
    env = ResidualFollower(gym.make(id_of("Bend-I30")))
    env.reset(seed=0)
    with pytest.raises(InputError, match="Expected a finite action with shape"):
        env.step(bad)


@pytest.mark.parametrize("scale", [0.0, -1.0, float("inf"), float("nan")])
def test_a_bad_scale_is_refused(scale):
    with pytest.raises(InputError, match="Expected a positive, finite scale in rad"):
        ResidualFollower(gym.make(id_of("Bend-I30")), scale=scale)


def test_where_the_follower_is_stuck_it_goes_as_far_as_it_can():
    env = gym.make(RANDOM)
    arm, lengths = env.unwrapped.arm, []
    for task in range(12):
        env.reset(options={"task_id": task})
        feeds, angles = follow_the_leader(env.unwrapped.maze, arm)
        assert angles.shape == (len(feeds), arm.n_links) and (np.diff(feeds) >= 0).all()
        lengths.append(feeds[-1])
    assert min(lengths) > 0.0
