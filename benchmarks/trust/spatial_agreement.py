"""Check random motions in space with `planners.spatial.validation` and with a plain twin, and compare.

Run from the repository's root with `python -m benchmarks.trust.spatial_agreement --count 1000 --seed 0`.
The twin takes one link and one box at a time. Apart from each other, the square of their distance is a
parabola between the places where the link passes the planes of the box's sides; one in the other, the sides
of all that the box covers when it slides along the link are tried for the shortest way out. Between poses
it samples.
"""

from __future__ import annotations

import argparse
import time
from itertools import pairwise

import numpy as np

from benchmarks.trust.results import write_results
from hrsnake_env.arm import ArmSpec
from hrsnake_env.errors import InputError
from planners.bench.pool import bar
from planners.spatial.kinematics import joints_from_configuration
from planners.spatial.problem import SpatialMotion
from planners.spatial.validation import validate
from planners.spatial.workspace import Workspace

CUTS = 8
"""Pieces into which the way from a pose to the next is cut."""


def signed_distance(start, end, low, high):
    """Return the distance from a segment to a box, or the depth of the one in the other as a negative."""
    way = end - start
    with np.errstate(all="ignore"):
        cuts = np.concatenate([(low - start) / way, (high - start) / way, [0.0, 1.0]])
    cuts = np.unique(cuts[(cuts >= 0.0) & (cuts <= 1.0)])
    shares = list(cuts)
    for one, other in pairwise(cuts):
        middle = start + (one + other) / 2.0 * way
        outside = (middle < low) | (middle > high)
        level = np.where(middle < low, low, high)
        square = float((way[outside] ** 2).sum())
        if square > 0.0:
            best = float((way[outside] * (level - start)[outside]).sum()) / square
            shares.append(min(max(best, one), other))
    points = start + np.array(shares)[:, None] * way
    distance = float(np.linalg.norm(points - np.clip(points, low, high), axis=1).min())
    if distance > 0.0:
        return distance
    directions = [*np.eye(3), *np.cross(np.eye(3), way)]
    overlaps = []
    for direction in directions:
        size = np.linalg.norm(direction)
        if size < 1e-12 * (1e-300 + np.linalg.norm(way)):
            continue
        for n in (direction / size, -direction / size):
            overlaps.append(np.maximum(n * low, n * high).sum() - min(n @ start, n @ end))
    return -max(0.0, float(min(overlaps)))


def least_distances(motion, workspace, joints, feed):
    """Return the least signed distance of all links to each box, over all poses."""
    length, n_links = motion.link_length, motion.n_links
    past = feed[:, None] - (n_links - np.arange(n_links + 1)) * length
    placed = np.where(past[..., None] < 0.0, motion.base_pose[:3], joints)
    least = np.full(len(workspace.obstacles), np.inf)
    for pose, link in np.argwhere(past[:, 1:] > 1e-9 * length):
        start, end = placed[pose, link], placed[pose, link + 1]
        for k, (low, high) in enumerate(workspace.obstacles):
            gap = np.maximum(low - np.maximum(start, end), np.minimum(start, end) - high).max()
            if gap < least[k]:
                least[k] = min(least[k], signed_distance(start, end, low, high))
    return least


def spatial_disagreements(motion, workspace, arm):
    """Yield a law and a sentence for everything on which the checker and its twin do not agree."""
    report, length, radius = validate(motion, workspace, arm), motion.link_length, arm.link_radius
    kinds = {fault.kind for fault in report.faults}
    clearance = (
        float(least_distances(motion, workspace, motion.joints, motion.feed).min(initial=np.inf)) - radius
    )
    steps = np.linalg.norm(np.diff(motion.joints, axis=0), axis=2).max(initial=0.0)
    lengths = np.abs(np.linalg.norm(np.diff(motion.joints, axis=1), axis=2) - length).max()
    goal = float(np.linalg.norm(motion.joints[-1, -1] - workspace.goal))
    figures = {"clearance": clearance, "largest_step": steps, "length_error": lengths, "goal_distance": goal}
    for name, twin in figures.items():
        one = getattr(report, name)
        if one != twin and not abs(one - twin) <= 1e-9 * length:
            yield name, f"{name} is {one!r}, by the twin {twin!r}"
    if abs(clearance + 1e-9 * length) > 1e-9 * length and (clearance < 0.0) is not ("penetration" in kinds):
        yield (
            "verdict: penetration",
            f"penetration is {'penetration' in kinds} at a clearance of {clearance!r}",
        )
    share = np.arange(CUTS + 1)[:, None] / CUTS
    low = np.full(len(workspace.obstacles), np.inf)
    for before in range(motion.n_poses - 1):
        feed, some = motion.feed[before : before + 2], motion.joint_angles[before : before + 2]
        feeds = feed[0] + share[:, 0] * (feed[1] - feed[0])
        angles = some[0] + share[..., None] * (some[1] - some[0])
        joints = joints_from_configuration(feeds, angles, length, motion.base_pose)
        low = np.minimum(low, least_distances(motion, workspace, joints, feeds))
    deep = radius - low
    if len(deep) and not report.penetration_between + 1e-9 * length >= deep.max():
        yield (
            "bound between",
            f"the bound is {report.penetration_between!r}, the twin gets {deep.max()!r} deep",
        )
    allowed = np.minimum(1e-3 * length, np.ptp(workspace.obstacles, axis=1).min(axis=1, initial=np.inf) / 8.0)
    if (deep > allowed + 1e-9 * length).any() and not kinds & {"sweep", "penetration"}:
        yield "verdict: sweep", "no fault where the twin is deep in an obstacle"
    if report.valid is bool(kinds):
        yield "valid", f"valid is {report.valid} with the faults {sorted(kinds)}"


def draw_spatial_case(rng):
    """Draw motion, workspace and arm; boxes are near where links come by."""
    for _ in range(100):
        length = float(rng.choice([1.0, 50.0]))
        n_links, n_poses = int(rng.integers(1, 5)), int(rng.integers(1, 6))
        heading = rng.normal(size=3) if rng.random() < 0.5 else np.eye(3)[rng.integers(3)]
        base_pose = np.concatenate([rng.uniform(-1, 1, 3) * length, heading / np.linalg.norm(heading)])
        feed = (rng.uniform(0.2, n_links) + 0.02 * rng.uniform(-1, 1) * np.arange(n_poses)) * length
        feed = np.clip(feed, 0.0, n_links * length)
        rate = rng.choice([0.0, 0.01, 0.2]) * rng.uniform(-1, 1, (n_links, 2))
        angles = rng.uniform(-0.9, 0.9, (n_links, 2)) + rate * np.arange(n_poses)[:, None, None]
        held = feed.min() - (n_links - np.arange(n_links)) * length <= 0.0
        angles[:, held] = 0.0
        motion = SpatialMotion.from_configurations(feed, angles, length, base_pose)
        boxes = []
        for _ in range(int(rng.integers(1, 5))):
            pose, link = rng.integers(n_poses), rng.integers(n_links)
            one, other = motion.joints[pose, link : link + 2]
            at = one + rng.uniform(-0.1, 1.1) * (other - one) + rng.uniform(-0.3, 0.3, 3) * length
            sides = length * 10.0 ** rng.uniform(-4.0, 0.0, 3)
            boxes.append([at, at + sides])
        low, high = motion.joints.min(axis=(0, 1)), motion.joints.max(axis=(0, 1))
        radius = length * float(rng.choice([0.0, 0.001, 0.05]))
        try:
            workspace = Workspace(
                name="case",
                room_low=low - length,
                room_high=high + length,
                base=base_pose[:3],
                heading=base_pose[3:],
                straight=1.001 * length,
                goal=motion.joints[-1, -1],
                goal_radius=0.1 * length,
                boxes=np.array(boxes),
            )
            motion.check_workspace(workspace)
        except InputError:
            continue  # base or goal in a box
        return motion, workspace, ArmSpec(link_length=length, link_radius=radius)
    raise AssertionError("no workspace in 100 draws")


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    start, done, broken = time.perf_counter(), 0, []
    try:
        with bar("space", options.count) as tell:
            for number in range(options.count):
                case = draw_spatial_case(np.random.default_rng([options.seed, number]))
                for law, sentence in spatial_disagreements(*case):
                    broken.append({"number": number, "law": law, "message": sentence})
                    print(f"case {number}: {law}: {sentence}", flush=True)
                done += 1
                tell()
    except KeyboardInterrupt:
        print("stopped")
    seconds = time.perf_counter() - start
    print(f"agreement in space: {done} cases, {len(broken)} faults, {seconds:.0f} s")
    figures = {"count": done, "seed": options.seed, "seconds": seconds, "faults": broken[:1000]}
    print(write_results("spatial_agreement", figures))
    return 1 if broken else 0


if __name__ == "__main__":
    raise SystemExit(main())
