"""`python -m skidpad` is the command `skidpad`."""

from skidpad.cli.main import main

if __name__ == "__main__":
    main()
