"""The paper's four-bar in closed form, its printed formulas and the data of its figures."""
