"""Writing: a chunk, evaluated and put into the store."""

from __future__ import annotations

from copsense.maps.evaluation import ChunkEvaluator
from copsense.maps.reduction import reduce_chunk
from copsense.maps.store import MapStore


def write_chunk(evaluator: ChunkEvaluator, store: MapStore, index: int) -> None:
    """Evaluate a chunk and write it, mark and all."""
    found = evaluator.evaluate(index)
    store.write(index, found, reduce_chunk(found, evaluator.plan.bounds(index)[0]))
