"""``python -m copsense``: the command line."""

from copsense.cli import main

if __name__ == "__main__":
    main()
