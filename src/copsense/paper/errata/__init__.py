"""Where the paper's printed text differs from what holds."""
