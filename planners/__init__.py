"""The mind: planners, the exact checker, and what turns a motion into actions."""

from planners.longest import LongestLink, longest_link
from planners.planning import PLANNERS, plan
from planners.problem import Fault, Motion, PlanningResult, PlanningStatus, ValidationReport
from planners.validation import validate

__all__ = [
    "PLANNERS",
    "Fault",
    "LongestLink",
    "Motion",
    "PlanningResult",
    "PlanningStatus",
    "ValidationReport",
    "longest_link",
    "plan",
    "validate",
]
