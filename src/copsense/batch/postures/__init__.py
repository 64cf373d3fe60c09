"""Many postures by named coordinates; see `copsense.batch.PostureChart`."""
