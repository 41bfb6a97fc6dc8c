"""``python -m thermal_robot`` is ``thermal-robot``."""

import sys

from thermal_robot.cli import main

if __name__ == "__main__":
    sys.exit(main())
