"""What asv records of a commit: see `posture`, and `benchmarks/history.py`, which runs it."""
