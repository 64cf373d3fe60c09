"""How the suite checks copsense's annotations: by beartype, as lenient as a type checker is."""

from collections.abc import Sequence
from typing import Any, get_args, get_origin

from beartype import BeartypeConf, FrozenDict, beartype
from numpy.typing import ArrayLike

# NumPy's protocol of a sequence asks for __reversed__, which a tuple does not have at run time.
_SEQUENCES = [
    m for m in get_args(ArrayLike) if "Sequence" in getattr(get_origin(m), "__name__", "")
]

check = beartype(
    conf=BeartypeConf(
        is_pep484_tower=True,  # an int serves as a float
        hint_overrides=FrozenDict(dict.fromkeys(_SEQUENCES, Sequence[Any])),
    )
)
