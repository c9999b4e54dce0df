"""The tables and pictures of `docs/spatial.md`, and the README's table about space.

Run `.venv/bin/hrsnake bench spatial --out benchmarks/results/spatial.json` first, and then
`.venv/bin/python docs/make_spatial.py` from the repository's root: it writes the tables between the marks
`<!-- table NAME -->` and `<!-- end -->`, and makes the pictures and the page of `docs/spatial/` anew.
"""

from __future__ import annotations

import json
import shutil
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hrsnake_env.files import replacing
from planners.bench.spatial import PARTS
from planners.bench.spatial_tables import spatial_markdown
from planners.spatial.figures import run_figures

ROOT = Path(__file__).parent.parent
RESULTS = ROOT / "benchmarks" / "results" / "spatial.json"
FOLDER = ROOT / "docs" / "spatial"
SHOWN = ("fig22.png", "tracked.png", "spatial.html")


def part(results: Mapping[str, Any], name: str) -> str:
    """Return what the benchmark prints of one of its parts, without the sentence about the machine."""
    text = spatial_markdown({key: value for key, value in results.items() if key not in PARTS or key == name})
    return text[text.index(f"**{name}**") :].strip()


def short(results: Mapping[str, Any]) -> str:
    """Return the README's table."""
    lines = [
        "| paired panels | links x length | in obstacles by | distance | time per pose | whole plan |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    for row in results["figures"]:
        depth, whole = row["depth"], row["median_s"]["whole"]
        lines.append(
            f"| {'longest ' if row['longest'] else ''}{NAMES[row['planner']]} | {row['n_links']} x "
            f"{row['link_length']:.4g} | {'nothing' if depth == 0.0 else f'{depth:.1f}'} | "
            f"{max(row['clearance'], 0.0):.2f} | {row['pose_s'] * 1e6:.2g} us | {whole * 1e3:.0f} ms |"
        )
    return "\n".join(lines)


NAMES = {"follow": "followed", "track": "tracked", "causal": "causal"}


def main() -> None:
    """Write all of it."""
    results = json.loads(RESULTS.read_text(encoding="utf-8"))
    tables = {name: part(results, name) for name in PARTS}
    tables["space"] = short(results)
    for path in (ROOT / "README.md", ROOT / "docs" / "spatial.md"):
        text = path.read_text(encoding="utf-8")
        for name, table in tables.items():
            mark = f"<!-- table {name} -->\n"
            if mark in text:
                start = text.index(mark) + len(mark)
                end = text.index("<!-- end -->", start)
                text = f"{text[:start]}\n{table}\n\n{text[end:]}"
        with replacing(path) as beside:
            beside.write_text(text, encoding="utf-8")
    with tempfile.TemporaryDirectory() as folder:
        run_figures(Path(folder))
        FOLDER.mkdir(exist_ok=True)
        for name in SHOWN:
            with replacing(FOLDER / name) as beside:
                shutil.copyfile(Path(folder, name), beside)


if __name__ == "__main__":
    main()
