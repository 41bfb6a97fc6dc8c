"""The commands, a file each: what it does, the options that it takes, and what it runs."""
