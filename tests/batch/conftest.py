"""The cases of the batch, made once."""

import pytest
from support.stances import CASES


@pytest.fixture(scope="session")
def case(stance_of):
    """A stance by the name of its case, made once."""
    made = {}

    def get(name):
        if name not in made:
            made[name] = CASES[name](stance_of)
        return made[name]

    return get
