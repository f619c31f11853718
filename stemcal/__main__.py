"""`python -m stemcal` is the command `stemcal`."""

from stemcal.cli.app import main

if __name__ == "__main__":
    main()
