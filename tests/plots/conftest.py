"""Small maps, made once."""

from support.small_maps import both, box, grid, sample, whole

__all__ = ["both", "box", "grid", "sample", "whole"]
