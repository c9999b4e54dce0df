"""From an occupancy image of 2,000 x 2,000 pixels to a validated plan: how long each step takes.

Run with `.venv/bin/python benchmarks/maps.py` from the repository's root. The images are floor plans with
pillars and slanted walls, drawn from seeds. Each is read and planned in a process of its own, and again in
that process. A first process, which is not counted, compiles the kernels. Prints a table and writes
`benchmarks/results/maps.json`.
"""

from __future__ import annotations

import json
import os
import platform
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image, ImageDraw

SIZE, SEEDS = 2000, 3
WALL, CORRIDOR, ROOMS = 16, 260, 4
PILLARS, SLANTED = 40, 12
LINK_LENGTH = 110.0
RESULTS = Path(__file__).parent / "results" / "maps.json"


def floor_plan(seed: int) -> Image.Image:
    """Draw rooms along a winding way, with doors, pillars and slanted walls."""
    rng = np.random.default_rng(seed)
    image = Image.new("L", (SIZE, SIZE), 254)
    draw = ImageDraw.Draw(image)
    draw.rectangle((0, 0, SIZE - 1, SIZE - 1), outline=0, width=WALL)
    side = SIZE / ROOMS
    for k in range(1, ROOMS):
        x = k * side + rng.uniform(-20, 20)
        draw.line((x, 0, x, SIZE), fill=0, width=WALL)  # doors at alternating ends: a way through all rooms
        y = SIZE - CORRIDOR if k % 2 else 40
        draw.rectangle((x - WALL, y, x + WALL, y + CORRIDOR - 40), fill=254)
    free_end = {0: (side / 2, SIZE - 100), ROOMS - 1: (SIZE - side / 2, 100)}
    for _ in range(PILLARS):
        x, y, r = rng.uniform(60, SIZE - 60), rng.uniform(CORRIDOR, SIZE - CORRIDOR), rng.uniform(8, 30)
        draw.ellipse((x - r, y - r, x + r, y + r), fill=0)
    for _ in range(SLANTED):
        x, y, turn = rng.uniform(100, SIZE - 100), rng.uniform(400, SIZE - 400), rng.uniform(0, np.pi)
        dx, dy = 70 * np.cos(turn), 70 * np.sin(turn)
        draw.line((x - dx, y - dy, x + dx, y + dy), fill=0, width=12)
    for x, y in free_end.values():
        draw.rectangle((x - 60, y - 60, x + 60, y + 60), fill=254)
    return image


def once(path: str) -> dict[str, Any]:
    """Read a map and plan in it; return seconds and counts."""
    start = time.perf_counter()
    from hrsnake_env.arm import ArmSpec
    from hrsnake_env.maps import read_map
    from planners import plan

    imported = time.perf_counter()
    reading = read_map(path)
    read = time.perf_counter()
    side = SIZE / ROOMS
    base, goal = (side / 2, 60.0, np.pi / 2), (SIZE - side / 2, SIZE - 100.0)
    maze = reading.maze(base_pose=base, goal=goal, goal_radius=20.0)
    made = time.perf_counter()
    result = plan(maze, ArmSpec(link_length=LINK_LENGTH))
    planned = time.perf_counter()
    return {
        "walls": len(maze.walls),
        "import": imported - start,
        "read": read - imported,
        "maze": made - read,
        "plan": planned - made,
        "all": planned - start,
        "status": str(result.status),
        "planner": result.planner,
        "links": None if result.motion is None else result.motion.n_links,
        "timings": {stage: float(value) for stage, value in result.timings.items()},
    }


def main() -> None:
    """Measure, print and write."""
    from hrsnake_env.files import replacing

    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(SEEDS):
            path = Path(folder) / f"plan{seed}.png"
            floor_plan(seed).save(path)
            child = [sys.executable, __file__, "--once", str(path)]
            if seed == 0:
                subprocess.run(child, check=True, capture_output=True)
            answer = subprocess.run(child, check=True, capture_output=True, text=True)
            fresh, warm = json.loads(answer.stdout)
            rows.append({"seed": seed, "fresh": fresh, "warm": warm})
    print("| floor plan | process | walls | import | image to outline | maze | plan | all | outcome |")
    print("|---|---|---|---|---|---|---|---|---|")
    for row in rows:
        for kind in ("fresh", "warm"):
            data = row[kind]
            steps = " | ".join(f"{data[step]:.2f} s" for step in ("import", "read", "maze", "plan", "all"))
            print(
                f"| {row['seed']} | {kind} | {data['walls']} | {steps} "
                f"| {data['status']}, {data['links']} links, {data['planner']} |"
            )
    RESULTS.parent.mkdir(exist_ok=True)
    machine = {"processor": platform.machine(), "cores": os.cpu_count()}
    with replacing(RESULTS) as part:
        part.write_text(json.dumps({"machine": machine, "maps": rows}, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    if sys.argv[1:2] == ["--once"]:
        print(json.dumps([once(sys.argv[2]), once(sys.argv[2])]))
    else:
        main()
