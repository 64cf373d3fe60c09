"""What the paper says, and what the numbers say of it."""
