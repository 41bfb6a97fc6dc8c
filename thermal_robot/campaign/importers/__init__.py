"""Importers of other programs' files: each format is a module here, registered in :mod:`run`."""
