"""How the suite checks copsense's annotations: by beartype, an int serving as a float."""

from beartype import BeartypeConf, beartype

check = beartype(conf=BeartypeConf(is_pep484_tower=True))
