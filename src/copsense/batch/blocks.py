"""Blocks: the rows of a batch, filled block by block on some threads."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor


def fill_blocks(
    filler: Callable[[], Callable[[int, int], object]], rows: int, block: int, threads: int
) -> None:
    """Have compiled code, which lets go of the interpreter, fill all rows.

    Args:
        filler: makes what one thread calls, with a workspace of its own: a function of a first row
            and an end.
        rows: how many there are.
        block: rows at a time.
        threads: how many share them, at most; no more are used than there are blocks.
    """
    blocks = -(-rows // block)
    threads = max(min(threads, blocks), 1)
    fills = [filler() for _ in range(threads)]

    def run(share: int) -> None:
        for i in range(share, blocks, threads):
            fills[share](i * block, min((i + 1) * block, rows))

    if threads == 1:
        run(0)
    else:
        with ThreadPoolExecutor(threads) as pool:
            list(pool.map(run, range(threads)))
