"""Planners of others, for comparison: functions of a query like ours, before the same checker."""
