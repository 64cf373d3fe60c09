"""What several tests share: robots, stances, other engines, and problems written apart."""
