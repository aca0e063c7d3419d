"""One musculotendon unit: parameters, curves, activation, contraction, window integration.

Knows no skeleton: lengths come in, forces go out.
"""
