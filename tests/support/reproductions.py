"""A reproduction with few postures, computed once for every test that looks at one."""

from functools import cache

from copsense.reproduction import reproduce

POSTURES = 21


@cache
def small_reproduction():
    return reproduce(postures=POSTURES)
