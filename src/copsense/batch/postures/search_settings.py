"""Search settings: what counts as reached, as too long a step, and as hopeless."""

DAMPING = 0.1  # of |h|^2
FLOOR = 1e-14  # of the trace of J J'
TINY = 1e-200  # where nothing moves: no division by zero
LONGEST_STEP = 0.5  # rad or m
MOST_STEPS = 60
PATIENCE = 6  # steps after which the worst error must have come down ...
PROGRESS = 0.5  # ... to this share
OPPOSITE = 0.2  # 1 + trace of a turn over about 155 deg, which is taken as this one
EDGE = 1e-9  # of a cell: how far beyond the ends of known postures a row may be, by rounding
SOLVED, UNSOLVED, STUCK, BEYOND, ELSEWHERE = 0, 1, 2, 3, 4  # how a search ended
