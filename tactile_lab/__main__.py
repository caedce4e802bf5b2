"""``python -m tactile_lab`` is ``tactile-lab``."""

from tactile_lab.cli import main

if __name__ == "__main__":
    main()
