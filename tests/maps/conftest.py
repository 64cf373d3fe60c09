"""Small maps, made once."""

from support.small_maps import both, box, grid, same, sample, whole

__all__ = ["both", "box", "grid", "same", "sample", "whole"]
