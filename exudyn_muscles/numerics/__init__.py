"""Compiled kernels, curves and splines; knows nothing of muscles."""
