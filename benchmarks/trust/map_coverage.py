"""Fuzzing of map readers that coverage guides: libFuzzer through atheris, where it is installed.

Run as `python -m benchmarks.trust.fuzz_maps --atheris --kind svg --count 100000`. Code of the readers is
instrumented, so inputs that reach new lines are kept and changed further. What is found first is written by
libFuzzer to the current folder's `crash-...`, and the process ends there.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

__all__ = ["guided"]


def guided(kind, count, seed):
    """Read so many inputs of a kind that coverage chooses; end the process at the first fault."""
    try:
        import atheris
    except ImportError:
        sys.exit("Expected atheris: pip install atheris, or leave out --atheris.")
    from hrsnake_env.maps import cells, inward, raster  # noqa: F401  (numba compiles no instrumented code)

    for name in [name for name in sys.modules if name.startswith("hrsnake_env.ma")]:
        if name.rpartition(".")[2] not in ("cells", "inward", "raster", "arm", "errors", "files"):
            del sys.modules[name]
    with atheris.instrument_imports(
        include=["hrsnake_env.maps", "hrsnake_env.maze", "svgelements", "yaml"],
        exclude=[f"hrsnake_env.maps.{each}" for each in ("cells", "inward", "raster")],
    ):
        import hrsnake_env.maze  # noqa: F401
        from hrsnake_env import maps
        from hrsnake_env.maps import dxf, geojson, image, outlines, ros, svg  # noqa: F401
    from benchmarks.trust.map_laws import SECONDS
    from benchmarks.trust.map_seeds import seeds
    from hrsnake_env.errors import InputError

    picture = seeds("image")[0][1]
    ending = seeds(kind)[0][0]

    def read(data):
        try:
            maps.read_map(f"map{ending}", None, lambda name: data if name.startswith("map.") else picture)
        except InputError as error:
            if not str(error).isprintable() or len(str(error)) >= 500:
                raise AssertionError(f"no sentence: {error!s:.200}") from None

    with tempfile.TemporaryDirectory() as folder:
        for number, (_, data) in enumerate(seeds(kind)):
            Path(folder, str(number)).write_bytes(data)
            read(data)  # what is compiled once does not count as hanging
        limits = [f"-runs={count}", f"-seed={seed + 1}", f"-timeout={int(6 * SECONDS)}", "-rss_limit_mb=2048"]
        atheris.Setup([sys.argv[0], *limits, "-max_len=20000", "-verbosity=1", folder], read)
        atheris.Fuzz()
