"""Frames of the environment: what they show, how large they are, and the window that shows them."""

import itertools
import os
import pickle
import subprocess
import sys

import gymnasium as gym
import numpy as np
import pytest
import shapely
from gymnasium.wrappers import RenderCollection

from hrsnake_env import InputError, Maze
from hrsnake_env.appearance import COLOURS, FAR, link_colours, mixed, rgb, shown_window
from hrsnake_env.contacts import PINCH_TOLERANCE, Contact
from hrsnake_env.rendering import FrameRenderer
from hrsnake_env.window import Window, import_pygame, open_display

pytestmark = pytest.mark.image

ID = "hrsnake_env:HyperRedundantMaze-v0"
SHORT = Maze.from_corridors([(0, 0), (0, 900)], 300.0, name="short", goal=(0.0, 450.0), goal_radius=40.0)
POSE = np.array([[0.0, -50.0], [0.0, 150.0], [60.0, 340.0]])
SIZES = [480, 64, (64, 64), (96, 96), (640, 480), (100, 30)]


def contact(kind, point, link=0, other=None):
    return Contact(
        pose=0,
        substep=0,
        link=link,
        kind=kind,
        wall=None if other is not None else 0,
        other=other,
        corner=None,
        point=point,
        clearance=0.0,
        impulse=0.0,
    )


def near(frame, colour, tolerance=40):
    """Return which pixels have about a colour."""
    return (np.abs(frame.astype(int) - rgb(colour)) <= tolerance).all(axis=-1)


# Frames


@pytest.mark.parametrize("size", [*SIZES, (85, 33)])
def test_a_frame_has_the_size_that_was_asked_for(size):
    renderer = FrameRenderer(SHORT, size=size)
    frame = renderer.draw(POSE)
    width, height = renderer.size
    assert frame.shape == (height, width, 3) and frame.dtype == np.uint8
    if isinstance(size, tuple):
        assert renderer.size == size
    else:
        assert height == size and width % 2 == 0


@pytest.mark.parametrize("size", [0, 14, 33, 64.0, True])
def test_a_height_that_no_video_could_have_is_refused(size):
    with pytest.raises(InputError, match=r"^Expected an even height in whole pixels, from 16, got"):
        FrameRenderer(SHORT, size=size)


@pytest.mark.parametrize("size", [(64, 15), (64.0, 64)])
def test_a_frame_too_small_to_see_anything_is_refused(size):
    with pytest.raises(InputError, match=r"^Expected a width and a height in whole pixels, from 16, got"):
        FrameRenderer(SHORT, size=size)


@pytest.mark.parametrize("name", ["fig19", "fig17b", "stairs"])
@pytest.mark.parametrize("size", SIZES)
def test_the_whole_window_of_the_maze_is_in_the_frame_and_y_points_up(name, size):
    maze = Maze.load(name)
    renderer = FrameRenderer(maze, size=size)
    x_min, y_min, x_max, y_max = shown_window(maze)
    corners = renderer.to_pixels([(x_min, y_max), (x_max, y_min)])
    assert (corners >= -1e-6).all() and (corners <= np.array(renderer.size) + 1e-6).all()
    assert (corners[1] > corners[0]).all()


def test_places_in_a_frame_are_points_of_the_maze_and_back():
    renderer = FrameRenderer(Maze.load("fig17b"))
    points = np.random.default_rng(0).uniform(-2000.0, 2000.0, (50, 2))
    np.testing.assert_allclose(renderer.to_maze(renderer.to_pixels(points)), points, atol=1e-8)


def test_what_is_free_is_bright_and_what_is_solid_is_not():
    maze = Maze.load("fig17b")  # with holes
    renderer = FrameRenderer(maze)
    frame = renderer.draw(np.array([[-1e5, 0.0], [-1e5, 1.0]]))  # out of sight
    rng = np.random.default_rng(0)
    x_min, y_min, x_max, y_max = shown_window(maze)
    points = rng.uniform((x_min, y_min), (x_max, y_max), (2000, 2))
    places = shapely.points(points)
    apart = shapely.distance(maze.free_space.boundary, places) > 0.01 * maze.size
    for mark in (maze.goal, maze.base_pose[:2]):
        apart &= np.hypot(*(points - mark).T) > maze.goal_radius + 0.02 * maze.size
    free = shapely.contains(maze.free_space, places)
    x, y = np.floor(renderer.to_pixels(points)).astype(int).T
    for kind, chosen in (("free", apart & free), ("wall", apart & ~free)):
        assert chosen.sum() > 100
        assert (frame[y[chosen], x[chosen]] == rgb(kind)).all()


@pytest.mark.parametrize("size", SIZES[:-1])
def test_every_link_shows_where_it_is_however_small_the_frame(size):
    renderer = FrameRenderer(SHORT, size=size)
    frame, empty = renderer.draw(POSE), renderer.draw(POSE - 1e5)
    for start, end in itertools.pairwise(POSE):
        for share in (0.6, 0.7, 0.8):
            x, y = np.floor(renderer.to_pixels(start + share * (end - start))).astype(int)
            here = slice(y - 1, y + 2), slice(x - 1, x + 2)
            differences = empty[here].astype(int).sum(axis=-1) - frame[here].astype(int).sum(axis=-1)
            assert differences.max() > 150  # of 765, from white to black
    changed = (frame != empty).any(axis=-1)
    # And nowhere else: no pixel farther from the arm than its marks are wide.
    y, x = np.nonzero(changed)
    away = shapely.distance(
        shapely.LineString(renderer.to_pixels(POSE)), shapely.points(np.column_stack([x, y]) + 0.5)
    )
    assert away.max() < 8.0


def test_a_thick_link_is_as_wide_as_twice_its_radius():
    renderer = FrameRenderer(SHORT, link_radius=40.0)
    frame, empty = renderer.draw(POSE), renderer.draw(POSE + 1e5)
    (left, y), (right, _) = renderer.to_pixels([(-150.0, 60.0), (150.0, 60.0)])
    row = (frame != empty).any(axis=-1)[int(y), int(left) : int(right)]
    wide = renderer.to_pixels((80.0, 0.0))[0] - renderer.to_pixels((0.0, 0.0))[0]
    assert abs(row.sum() - wide) <= 2.0


def test_a_frame_belongs_to_who_asked_for_it():
    renderer = FrameRenderer(SHORT)
    first = renderer.draw(POSE)
    kept = first.copy()
    first[:] = 0
    np.testing.assert_array_equal(renderer.draw(POSE), kept)


def test_the_arm_of_a_simulation_that_broke_down_is_left_out():
    renderer = FrameRenderer(SHORT)
    np.testing.assert_array_equal(renderer.draw(np.full((3, 2), np.nan)), renderer.draw(POSE + 1e5))


def test_pinches_and_collisions_are_marked_where_they_are():
    renderer = FrameRenderer(SHORT)
    plain = renderer.draw(POSE)
    for kind, point in (("pinch", (-150.0, 600.0)), ("collision", (150.0, 700.0))):
        frame = renderer.draw(POSE, contacts=[contact(kind, point)])
        x, y = np.floor(renderer.to_pixels(point)).astype(int)
        here = slice(y - 9, y + 10), slice(x - 9, x + 10)
        assert near(frame[here], kind).sum() > 10 > near(plain[here], kind).sum()


def test_the_pose_that_was_aimed_at_shows_beside_the_arm():
    renderer = FrameRenderer(SHORT)
    aimed = POSE.copy()
    aimed[2, 0] -= 100.0
    frame, plain = renderer.draw(POSE, target_joints=aimed), renderer.draw(POSE)
    x, y = np.floor(renderer.to_pixels((aimed[1] + aimed[2]) / 2)).astype(int)
    assert (frame[y - 1 : y + 2, x - 1 : x + 2] != plain[y - 1 : y + 2, x - 1 : x + 2]).any()


# Colours


def test_the_nearer_a_free_link_is_to_a_wall_the_nearer_its_colour_is_to_the_lighter_one():
    clearances = np.array([10.0, FAR, 0.05, 0.01, 0.002, PINCH_TOLERANCE, 0.0, -1.0]) * 430.0
    colours = np.array(link_colours(8, clearances=clearances, link_length=430.0))
    assert (np.diff(colours, axis=0) >= 0).all()
    assert tuple(colours[0]) == tuple(colours[1]) == rgb("arm")
    assert tuple(colours[5]) == tuple(colours[7]) == rgb("near")
    assert tuple(link_colours(1, clearances=[0.01], link_length=1.0)[0]) == mixed(
        rgb("arm"), rgb("near"), 0.5
    )


def test_what_touches_has_its_own_colour_and_a_collision_outweighs_a_pinch():
    contacts = [contact("collision", (0.0, 0.0), 1, 3), contact("pinch", (0.0, 0.0), 1)]
    contacts.append(contact("pinch", (0.0, 0.0), 2))
    expected = ["arm", "collision", "pinch", "collision"]
    assert link_colours(4, contacts=contacts) == [rgb(name) for name in expected]
    assert set(expected) <= set(COLOURS)


# The environment


def test_a_frame_shows_nothing_of_another_environment():
    envs = [gym.make(ID, maze=name, render_mode="rgb_array") for name in ("fig19", "fig17b")]
    alone = []
    for env in envs:
        env.reset()
        alone.append(env.render())
    action = np.ones(envs[0].action_space.shape)
    envs[0].step(action)
    np.testing.assert_array_equal(envs[1].render(), alone[1])
    assert (envs[0].render() != alone[0]).any()
    for env in envs:
        env.close()


def test_a_wrapper_collects_a_frame_for_the_reset_and_each_step():
    env = RenderCollection(gym.make(ID, maze="fig19", link_length=430.0, render_mode="rgb_array"))
    env.reset()
    for _ in range(3):
        env.step(np.ones(env.action_space.shape))
    frames = env.render()
    assert len(frames) == 4
    assert all((a != b).any() for a, b in itertools.pairwise(frames))


def test_an_episode_becomes_a_video(tmp_path):
    env = gym.make(ID, maze="fig19", link_length=430.0, render_mode="rgb_array")
    env = gym.wrappers.RecordVideo(env, str(tmp_path / "videos"), episode_trigger=lambda episode: True)
    env.reset()
    for _ in range(5):
        env.step(np.ones(env.action_space.shape))
    env.close()
    assert [path.suffix for path in (tmp_path / "videos").iterdir()] == [".mp4"]


def test_a_renderer_and_a_window_go_to_another_process_and_draw_the_same():
    renderer, window = FrameRenderer(SHORT), Window((64, 64), fps=1e6, title="short")
    frame = renderer.draw(POSE)
    window.show(FrameRenderer(SHORT, size=(64, 64)).draw(POSE))
    try:
        copy, other = pickle.loads(pickle.dumps((renderer, window)))
        np.testing.assert_array_equal(copy.draw(POSE), frame)
        other.show(FrameRenderer(SHORT, size=(64, 64)).draw(POSE))
        other.close()
    finally:
        window.close()


# The window


def shown():
    """Return what the window shows, shape (height, width, 3)."""
    pygame = import_pygame()
    return np.transpose(pygame.surfarray.array3d(pygame.display.get_surface()), (1, 0, 2))


def test_a_human_sees_the_reset_and_every_step_and_render_returns_nothing():
    pygame = import_pygame()
    env = gym.make(ID, maze="fig19", link_length=430.0, render_mode="human")
    frames = gym.make(ID, maze="fig19", link_length=430.0, render_mode="rgb_array")
    env.reset()
    frames.reset()
    np.testing.assert_array_equal(shown(), frames.render())
    for _ in range(2):
        env.step(np.ones(env.action_space.shape))
        frames.step(np.ones(env.action_space.shape))
        np.testing.assert_array_equal(shown(), frames.render())
    assert env.render() is None
    env.close()
    assert not pygame.display.get_init()


def test_closing_one_window_leaves_the_other():
    pygame = import_pygame()
    envs = [gym.make(ID, maze="fig19", render_mode="human") for _ in range(2)]
    for env in envs:
        env.reset()
    envs[0].close()
    assert pygame.display.get_init()
    envs[1].step(np.zeros(envs[1].action_space.shape))
    envs[1].close()
    assert not pygame.display.get_init()


def test_a_window_that_its_user_closed_stays_closed_until_it_is_closed_by_the_program():
    pygame = import_pygame()
    window = Window((32, 16), fps=1e6, title="dark")
    frame = np.zeros((16, 32, 3), dtype=np.uint8)
    window.show(frame)
    pygame.event.post(pygame.event.Event(pygame.QUIT))
    window.show(frame)
    assert window.dismissed and not pygame.display.get_init()
    window.show(frame)
    assert not pygame.display.get_init()
    window.close()
    window.show(frame)
    assert pygame.display.get_init()
    window.close()


def test_nothing_but_the_display_is_started():
    pygame = import_pygame()
    window = Window((32, 16), fps=1e6, title="quiet")
    window.show(np.zeros((16, 32, 3), dtype=np.uint8))
    assert pygame.mixer.get_init() is None and not pygame.font.get_init() and not pygame.joystick.get_init()
    window.close()


def test_without_pygame_frames_are_drawn_all_the_same_and_a_window_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "pygame", None)
    FrameRenderer(SHORT).draw(POSE)
    with pytest.raises(gym.error.DependencyNotInstalled, match=r'pip install "hrsnake\[play\]"'):
        gym.make(ID, maze="fig19", render_mode="human").reset()


def test_pygame_is_imported_by_the_window_alone():
    code = (
        "import sys, gymnasium as gym\n"
        f"env = gym.make('{ID}', maze='fig19', render_mode='rgb_array')\n"
        "env.reset(); env.render()\n"
        "print(sorted({'pygame', 'matplotlib'} & set(sys.modules)))\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere there is always a display")
def test_without_a_display_a_window_says_so(monkeypatch):
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "SDL_VIDEODRIVER"):
        monkeypatch.delenv(name, raising=False)
    with pytest.raises(InputError, match=r"^Expected a display to open a window on, got none: neither"):
        open_display((32, 16), "nowhere")


def test_a_display_that_does_not_work_is_named(monkeypatch):
    monkeypatch.setitem(os.environ, "SDL_VIDEODRIVER", "nonesuch")
    with pytest.raises(InputError, match=r"^Expected a display to open a window on, got none: .*nonesuch"):
        open_display((32, 16), "nowhere")
