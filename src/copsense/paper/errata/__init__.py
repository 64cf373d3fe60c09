"""Where the paper's printed text differs from what holds, with the numbers."""

from copsense.paper.errata.errata_table import ERRATA, evaluate_errata
from copsense.paper.errata.erratum import Erratum, EvaluatedErratum
from copsense.paper.errata.formula import Formula

__all__ = ["ERRATA", "Erratum", "EvaluatedErratum", "Formula", "evaluate_errata"]
