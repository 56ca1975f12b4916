"""Makes `python -m surfsig.cli` the same as `surfsig`."""

from surfsig.cli import main

if __name__ == "__main__":
    main()
