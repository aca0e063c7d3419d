"""Muscle paths: frames of links in; lengths, and pulls at links and coordinates, out."""
