"""Entry point of ``python -m thermal_robot``, the same as the command ``thermal-robot``."""

import sys

from thermal_robot.cli import main

if __name__ == "__main__":
    sys.exit(main())
