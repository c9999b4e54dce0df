"""The parts of the exact checker, `planners.validation`; none of them knows a planner."""
