"""Measurements of speed and scale, beside other planners, in one run."""
