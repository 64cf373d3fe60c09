"""In a closed loop, check the shapes of the first steps and of some later ones.

A loop calls the same functions with the same shapes a thousand times for each simulated second, and
checking each call takes twice as long as the loop itself.
"""

from jaxtyping import config

ALL, SOME = 50, 20  # the first so many control periods, then every so many-th


def sample_checks():
    """From here on, for every run of this process."""
    from copsense.simulation import control_loop

    ask, run, number = control_loop.ask, control_loop._run, 0

    def counted(*arguments):
        nonlocal number
        number += 1
        config.update("jaxtyping_disable", number > ALL and number % SOME != 0)
        return ask(*arguments)

    def one(*arguments):
        nonlocal number
        number = 0
        try:
            return run(*arguments)
        finally:
            config.update("jaxtyping_disable", False)

    control_loop.ask, control_loop._run = counted, one
