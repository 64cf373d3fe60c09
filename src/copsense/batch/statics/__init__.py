"""Equilibria and sensitivities of many configurations; see `copsense.batch.evaluate_batch`."""
