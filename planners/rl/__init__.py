"""Reinforcement learning: settings, training, policies as plain arrays, and their evaluation."""
