"""Musculotendon geometry: length l, lengthening speed l' and moment arms r = -dl/dq.

Plain functions of arrays; the tree's arrays come from the skeleton.
"""
