"""Other programs' files become campaigns: a format is a module here, and a line in :mod:`run`."""
