"""A reproduction with few postures, computed once for every test that looks at one."""

from functools import cache

from copsense.paper.reproduce import reproduce_paper

POSTURES = 21


@cache
def small_reproduction():
    return reproduce_paper(postures=POSTURES)
