"""The mind: planners, the exact checker, and what turns a motion into actions."""

from planners.planning import PLANNERS, plan
from planners.problem import Fault, Motion, PlanningResult, PlanningStatus, ValidationReport
from planners.validation import validate

__all__ = [
    "PLANNERS",
    "Fault",
    "Motion",
    "PlanningResult",
    "PlanningStatus",
    "ValidationReport",
    "plan",
    "validate",
]
