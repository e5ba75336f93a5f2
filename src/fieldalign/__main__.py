"""python -m fieldalign: the same as the command fieldalign."""

from .cli import main

if __name__ == "__main__":
    main()
