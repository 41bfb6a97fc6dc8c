"""Commands of the program, a file each: description, options, action."""
