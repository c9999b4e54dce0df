"""The mind: planners, the exact checker, and what turns a motion into actions."""

from planners.longest import LongestLink, longest_link
from planners.planning import PLANNERS, plan
from planners.problem import (
    Attempt,
    Failure,
    Fault,
    Motion,
    PlanningResult,
    PlanningStatus,
    ValidationReport,
)
from planners.rod_bound import RodBound, rod_bound
from planners.validation import validate

__all__ = [
    "PLANNERS",
    "Attempt",
    "Failure",
    "Fault",
    "LongestLink",
    "Motion",
    "PlanningResult",
    "PlanningStatus",
    "RodBound",
    "ValidationReport",
    "longest_link",
    "plan",
    "rod_bound",
    "validate",
]
