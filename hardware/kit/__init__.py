"""The sensor's mechanics as parametric code: parts, jigs, checks and drawings (docs/kit.md)."""
