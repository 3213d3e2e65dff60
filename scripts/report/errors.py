"""Errors that a user can correct."""


class ReportError(Exception):
    """Bad input. The message names the file, what was found and what would do."""
