"""The parts of the exact checker in space; its public face is `planners.spatial.validation`."""
