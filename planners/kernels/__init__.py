"""Numba kernels: floats and arrays in and out."""
