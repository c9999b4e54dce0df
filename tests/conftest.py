"""Settings of the whole suite."""

import os

from hypothesis import settings

# Windows open on a display that nobody sees; pygame reads this when it starts.
os.environ.setdefault("SDL_VIDEODRIVER", "dummy")

# Kernels are compiled at their first call, which no deadline should count.
settings.register_profile("local", deadline=None)
settings.register_profile("ci", deadline=None, derandomize=True)
settings.load_profile("ci" if os.environ.get("CI") else "local")
