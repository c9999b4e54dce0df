"""Driving by hand: the tip is steered and the arm follows, a plan takes over, a window shows it."""

import math
import sys

import gymnasium as gym
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

import planners.game
from hrsnake_env import ArmSpec, InputError, Maze
from hrsnake_env.arm import configuration_from_joints, joints_from_configuration
from hrsnake_env.task import FEED_STEP, JOINT_STEP, LARGEST_STEP
from hrsnake_env.window import import_pygame
from planners import plan
from planners.cli import main
from planners.driving import LARGEST_TURN, TURN_STEP, MotionDriver, TipDriver, joints_along
from planners.game import Controls, Game
from planners.play import play

LENGTH, N_LINKS = 100.0, 6
BASE = np.array([30.0, -20.0, 0.7])
LIMITS = np.array([FEED_STEP * LENGTH, *([JOINT_STEP] * N_LINKS)])
EXACT = 1e-9 * LENGTH
HALL = Maze.from_corridors([(0, 0), (0, 4000)], 4000.0, name="hall", goal=(0.0, 3900.0), goal_radius=40.0)
SHORT = Maze.from_corridors([(0, 0), (0, 900)], 300.0, name="short", goal=(0.0, 450.0), goal_radius=40.0)


def straight(feed):
    return joints_from_configuration(feed, np.zeros(N_LINKS), LENGTH, BASE)


class Driven:
    """Drive an arm that does what it is told, and remember where its tip has been."""

    def __init__(self, feed=0.0):
        self.target = np.array([feed, *([0.0] * N_LINKS)])
        self.driver = TipDriver(straight(feed), LENGTH, BASE)
        self.tips = [self.driver.joints[-1]]

    def go(self, turn, feed):
        """Take one step, and make sure that it is one."""
        action = self.driver.action(self.target, turn, feed)
        assert np.abs(action).max() <= 1.0
        before = self.joints
        self.target = self.target + action * LIMITS
        assert np.hypot(*(self.joints - before).T).max() <= LARGEST_STEP * LENGTH * (1.0 + 1e-5)
        self.tips.append(self.driver.joints[-1])
        return action

    @property
    def joints(self):
        """Where the arm is."""
        return joints_from_configuration(self.target[0], self.target[1:], LENGTH, BASE)


# The tip, and what follows it


def test_feed_alone_pushes_the_arm_straight_in():
    driven = Driven()
    for k in range(1, 101):
        np.testing.assert_allclose(driven.go(0.0, 1.0), [1.0, *([0.0] * N_LINKS)], atol=1e-9)
        np.testing.assert_allclose(driven.joints, straight(k * FEED_STEP * LENGTH), atol=EXACT)


def test_every_joint_follows_the_path_of_the_tip():
    driven = Driven()
    for k in range(230):
        driven.go(0.3 * math.sin(k / 20.0), 1.0)
    behind = straight(0.0)[0]
    path = shapely.LineString(np.vstack([behind, *driven.tips]))
    away = shapely.distance(path, shapely.points(driven.joints))
    assert away.max() < 1e-7 * LENGTH
    np.testing.assert_allclose(np.hypot(*np.diff(driven.joints, axis=0).T), LENGTH, rtol=1e-9)
    assert np.ptp(driven.target[1:]) > 0.3  # it was no straight line


def test_going_back_the_whole_path_ends_at_the_start():
    driven = Driven()
    for k in range(200):
        driven.go(0.4 * math.cos(k / 15.0), 1.0)
    assert np.abs(driven.target[1:]).max() > 0.1
    for _ in range(2000):
        if not driven.go(0.0, -1.0).any():
            break
    assert driven.driver.note == "the arm is all in the feeder"
    np.testing.assert_allclose(driven.target, 0.0, atol=1e-6)
    assert driven.driver.heading == pytest.approx(BASE[2])


def test_the_arm_goes_back_through_the_poses_it_came_through():
    driven = Driven(150.0)
    came = []
    for _ in range(120):
        driven.go(0.2, 0.5)
        came.append(driven.target)
    table = np.array(came)
    for _ in range(100):
        driven.go(0.0, -0.5)
        nearest = np.abs(table - driven.target).max(axis=1).argmin()
        around = table[max(nearest - 1, 0) : nearest + 2]
        assert (driven.target >= around.min(axis=0) - 1e-4).all()
        assert (driven.target <= around.max(axis=0) + 1e-4).all()


@settings(max_examples=30)
@given(
    st.lists(
        st.tuples(
            st.sampled_from([-1.0, -0.3, 0.0, 0.1, 1.0]),
            st.sampled_from([-1.0, -0.01, 0.0, 0.5, 1.0]),
            st.integers(1, 40),
        ),
        max_size=12,
    ),
    st.sampled_from([0.0, 1e-9, 99.9999, 100.0, 350.0, 600.0]),
)
def test_whatever_is_asked_for_the_arm_stays_whole_and_goes_where_it_is_sent(wishes, feed):
    driven = Driven(feed)
    for turn, way, times in wishes:
        for _ in range(times):
            driven.go(turn, way)
    np.testing.assert_allclose(driven.joints, driven.driver.joints, atol=1e-6 * LENGTH)
    assert -EXACT <= driven.target[0] <= N_LINKS * LENGTH + 1e-6 * LENGTH
    off = driven.driver.heading - math.atan2(*(driven.joints[-1] - driven.joints[-2])[::-1])
    assert abs(math.remainder(off, 2.0 * math.pi)) <= LARGEST_TURN + 1e-6
    in_feeder = driven.target[1:][np.arange(N_LINKS) <= N_LINKS - driven.target[0] / LENGTH - 1e-6]
    np.testing.assert_allclose(in_feeder, 0.0, atol=1e-6)


def test_the_simulated_arm_takes_the_actions_as_they_are():
    env = gym.make("hrsnake_env:HyperRedundantMaze-v0", maze=HALL, link_length=LENGTH, n_links=N_LINKS)
    env.reset()
    world = env.unwrapped
    driver = TipDriver(world.physics.target_joints, LENGTH, HALL.base_pose)
    for k in range(150):
        env.step(driver.action(world.target, math.sin(k / 9.0), 1.0))
        wanted = configuration_from_joints(driver.joints, LENGTH, HALL.base_pose)
        np.testing.assert_allclose(world.target, [wanted[0], *wanted[1]], atol=1e-6 * LENGTH)
    assert world.physics.node_error < 1e-3 * LENGTH
    assert np.abs(world.target[1:]).max() > 0.1


def test_the_heading_turns_at_its_rate_and_not_before_the_first_link_is_out():
    driven = Driven(0.5 * LENGTH)
    driven.go(1.0, 0.0)
    assert driven.driver.heading == BASE[2] and driven.driver.note == "the first link goes straight"
    driven = Driven(1.5 * LENGTH)
    assert not driven.go(-1.0, 0.0).any()
    assert driven.driver.heading == pytest.approx(BASE[2] - TURN_STEP)
    for _ in range(50):
        driven.go(-1.0, 0.0)
    assert driven.driver.heading == pytest.approx(BASE[2] - LARGEST_TURN)


def test_an_arm_at_its_end_says_so():
    driven = Driven(N_LINKS * LENGTH)
    assert not driven.go(0.0, 1.0).any()
    assert driven.driver.note == "the arm is all out of the feeder"


def test_an_arm_that_was_pushed_off_its_path_comes_back_to_a_place_that_it_has_passed():
    driven = Driven(150.0)
    for _ in range(60):
        driven.go(0.3, 1.0)
    path, tip = shapely.LineString(np.vstack([straight(0.0)[0], *driven.tips])), driven.tips[-1]
    driven.driver.step_back()
    driven.target = driven.target + 0.01
    for _ in range(10):
        action = driven.driver.return_action(driven.target)
        assert np.abs(action).max() <= 1.0
        driven.target = driven.target + action * LIMITS
    assert not driven.driver.return_action(driven.target).any()
    near = 0.01 * LARGEST_STEP * LENGTH
    assert shapely.distance(path, shapely.points(driven.joints)).max() < near
    assert np.hypot(*(driven.joints[-1] - tip)) == pytest.approx(FEED_STEP * LENGTH, abs=near)


def test_joints_on_a_straight_path_are_a_link_apart():
    path = np.array([[-10.0, 0.0], [-3.0, 0.0], [0.0, 0.0], [0.5, 0.0]])
    np.testing.assert_allclose(joints_along(path, 3, 2.0), [[-5.5, 0], [-3.5, 0], [-1.5, 0], [0.5, 0]])


# A planned motion


@pytest.fixture(scope="module")
def motion():
    return plan(Maze.load("fig19"), ArmSpec(link_length=430.0), "sweep").motion


def drive(driver, target, limits):
    """Follow a motion to its end, and return the targets on the way."""
    targets = [target]
    while not driver.done:
        action = driver.action(targets[-1])
        assert np.abs(action).max() <= 1.0
        targets.append(targets[-1] + action * limits)
        assert len(targets) < 10_000
    return np.array(targets)


def test_a_motion_is_driven_through_every_pose_to_its_end(motion):
    limits = np.array([FEED_STEP * 430.0, *([JOINT_STEP] * motion.n_links)])
    targets = drive(MotionDriver(motion), np.array([motion.feed[0], *motion.joint_angles[0]]), limits)
    poses = np.column_stack([motion.feed, motion.joint_angles])
    away = np.abs((targets[:, None] - poses[None]) / limits).max(axis=-1)
    assert away.min(axis=0).max() < 1e-6


def test_an_arm_on_the_motion_joins_it_and_one_off_it_does_not(motion):
    driver = MotionDriver(motion)
    middle = motion.n_poses // 2
    pose = np.array([motion.feed[middle], *motion.joint_angles[middle]])
    off = pose + np.array([0.0, *([0.0] * (motion.n_links - 1)), 0.5])
    assert not driver.join(off) and driver.pose == 0
    assert driver.join(pose + 0.001)
    assert abs(driver.pose - middle) <= 1


# The game


def test_the_mouse_turns_the_tip_to_the_pointer_and_the_keys_add_up():
    tip = np.array([0.0, 0.0])
    controls = Controls(held={"left", "up"})
    assert controls.read(tip, 0.0, tip) == (1.0, 1.0)
    controls.held = {"left", "right", "down"}
    assert controls.read(tip, 0.0, tip) == (0.0, -1.0)
    controls.held = {"to_pointer"}
    assert controls.read(tip, 3.1, np.array([-1.0, -0.1])) == (1.0, 1.0)  # the short way round
    assert controls.read(tip, 0.0, np.array([1.0, -0.05]))[0] == pytest.approx(-0.05 / TURN_STEP, rel=1e-2)
    controls.held = {"back", "up"}
    assert controls.read(tip, 0.0, tip) == (0.0, -1.0)


def test_a_player_who_holds_the_feed_key_reaches_a_goal_straight_ahead():
    game = Game(SHORT)
    game.controls.held.add("up")
    for _ in range(300):
        game.advance()
    assert game.over == "goal reached, clean" and "goal reached, clean" in game.lines[0]
    feed = game.info["feed"]
    game.advance()
    assert game.info["feed"] == feed
    game.reset()
    assert game.over == "" and game.info["feed"] == pytest.approx(0.0)


def test_an_arm_that_nobody_drives_stands_still():
    game = Game(SHORT)
    before = game.frame()
    for _ in range(5):
        game.advance()
    np.testing.assert_array_equal(game.frame(), before)
    assert game.world.physics.pose == 0


def test_a_wall_stops_the_arm_instead_of_breaking_it_and_it_can_go_back():
    game = Game(SHORT, link_length=200.0)
    game.controls.held.update({"up"})
    for _ in range(55):
        game.advance()
    game.controls.held.add("right")
    news = set()
    for _ in range(100):
        game.advance()
        news.add(game.news)
        assert game.world.physics.node_error < 0.05 * 200.0 and not game.over
    assert "a wall is in the way: turn, or go back" in news and game.collisions > 0
    assert game.lines[0].endswith("not clean")
    game.controls.held = {"down"}
    for _ in range(10):
        game.advance()
    assert game.info["collisions"] == 0 and game.news == "you drive"


def test_the_planner_takes_over_from_the_start_and_reaches_the_goal():
    game = Game(Maze.load("fig19"), 430.0, planner="sweep")
    game.hand_over()
    assert game.by_plan
    for _ in range(1000):
        game.advance()
        if game.over:
            break
    assert game.over == "goal reached, clean"
    assert game.collisions == 0
    game.hand_over()
    assert game.by_plan and game.over == "" and game.info["feed"] == pytest.approx(0.0)
    assert "back to the start" in game.lines[1]


def test_a_player_takes_over_from_the_planner_where_the_arm_is_and_gives_it_back():
    game = Game(Maze.load("fig19"), 430.0, planner="sweep")
    game.hand_over()
    for _ in range(60):
        game.advance()
    feed = game.info["feed"]
    assert feed > 430.0
    game.hand_over()
    assert not game.by_plan and game.info["feed"] == feed
    np.testing.assert_allclose(game.driver.joints, game.world.physics.target_joints)
    game.hand_over()
    assert game.by_plan and game.info["feed"] == feed and "(from here)" in game.lines[1]


def test_where_there_is_no_plan_the_screen_says_why_and_the_player_drives_on():
    game = Game(Maze.load("fig19"), 430.0, 2)
    game.hand_over()
    assert not game.by_plan and "Expected at least 6 links" in game.lines[1]
    game = Game(Maze.load("fig19"), 460.0, planner="sweep")  # rods longer than 440 do not pass
    game.hand_over()
    assert not game.by_plan and game.lines[1].startswith("no plan: ")


# The window


def post(kind, **values):
    pygame = import_pygame()
    pygame.event.post(pygame.event.Event(kind, **values))


def test_keys_and_mouse_drive_the_arm_in_the_window_until_it_is_closed():
    pygame = import_pygame()
    feeds = []

    def each_frame(game):
        feeds.append(game.info["feed"])
        moves = {
            1: lambda: post(pygame.KEYDOWN, key=pygame.K_UP),
            6: lambda: post(pygame.KEYUP, key=pygame.K_UP),
            9: lambda: post(pygame.MOUSEBUTTONDOWN, button=1, pos=(480, 300)),
            12: lambda: post(pygame.MOUSEBUTTONUP, button=1, pos=(480, 300)),
            14: lambda: post(pygame.KEYDOWN, key=pygame.K_r),
            16: lambda: post(pygame.QUIT),
        }
        moves.get(len(feeds), lambda: None)()

    play(SHORT, 200.0, each_frame=each_frame)
    assert not pygame.display.get_init() and not pygame.font.get_init()
    steps = np.diff(feeds[:14])
    assert (steps[[1, 2, 3, 4, 9, 10]] > 0.5 * FEED_STEP * 200.0).all()
    assert abs(steps[7]) < 1e-6 and abs(steps[12]) < 1e-6
    assert feeds[14] == pytest.approx(0.0) and len(feeds) == 16


def test_what_is_drawn_stands_below_and_above_what_is_written():
    pygame = import_pygame()
    pictures = []

    def each_frame(game):
        surface = pygame.display.get_surface()
        pictures.append((np.transpose(pygame.surfarray.array3d(surface), (1, 0, 2)), game.frame()))
        post(pygame.KEYDOWN, key=pygame.K_q)

    play(SHORT, 200.0, each_frame=each_frame)
    screen, frame = pictures[0]
    height = frame.shape[0]
    top = next(k for k in range(100) if (screen[k, :50] == frame[0, :50]).all())
    same = (screen[top : top + height] == frame).all(axis=-1)
    assert same.mean() > 0.999  # all but the heading of the tip
    for bar in (screen[:top], screen[top + height :]):
        assert bar.min() < 80 < 200 < bar.max()


def test_a_player_who_goes_while_the_planner_thinks_need_not_wait(monkeypatch):
    pygame = import_pygame()
    frames = []

    def each_frame(game):
        frames.append(game.by_plan)
        post(pygame.KEYDOWN, key=pygame.K_SPACE)
        post(pygame.KEYUP, key=pygame.K_SPACE)

    def thinking(maze, arm, planner, *, explain, progress):
        post(pygame.KEYDOWN, key=pygame.K_ESCAPE)
        progress("path", 0.5)
        raise AssertionError("the planner went on")

    monkeypatch.setattr(planners.game, "plan", thinking)
    play(SHORT, 200.0, each_frame=each_frame)
    assert frames == [False] and not pygame.display.get_init()


# The command


@pytest.fixture
def run(capsys, monkeypatch):
    def run_command(*arguments):
        monkeypatch.setattr(sys, "argv", ["hrsnake", *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            main()
        output = capsys.readouterr()
        return ended.value.code or 0, output.out, output.err

    return run_command


def test_the_command_opens_the_window_and_ends_with_it(run):
    pygame = import_pygame()
    pygame.display.init()
    post(pygame.QUIT)
    assert run("play", "fig19", "--link-length", 430, "--links", 7, "--planner", "beam") == (0, "", "")


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ("nowhere", "Unknown maze 'nowhere'."),
        ("fig19 --planner fly", "Unknown planner 'fly'. Available: auto, "),
        ("fig19 --link-length -1", "Expected a positive, finite link_length, got -1.0."),
    ],
)
def test_bad_input_gets_one_sentence(arguments, sentence, run):
    code, out, err = run("play", *arguments.split())
    assert code == 2 and err.startswith("hrsnake: " + sentence)
    assert err.count("\n") == 1 and out == ""


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere there is always a display")
def test_without_a_display_the_command_says_so_in_one_sentence(run, monkeypatch):
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "SDL_VIDEODRIVER"):
        monkeypatch.delenv(name, raising=False)
    code, out, err = run("play")
    assert code == 2 and err.startswith("hrsnake: Expected a display to open a window on, got none")
    assert err.count("\n") == 1 and out == ""


def test_without_pygame_the_command_says_what_to_install(run, monkeypatch):
    monkeypatch.setitem(sys.modules, "pygame", None)
    code, _, err = run("play")
    assert code == 2 and 'pip install "hrsnake[play]"' in err and err.count("\n") == 1


def test_an_unknown_planner_is_refused_before_anything_opens():
    with pytest.raises(InputError, match=r"^Unknown planner 'fly'\. Available: auto, "):
        Game(SHORT, planner="fly")
