"""The one exception that a user sees."""


class UserError(Exception):
    """The work cannot be done, and the user can change that.

    The text is one clear sentence: what is wrong, where (file, line, column, key) and what to do.
    The command line prints it as ``error: ...`` and ends with status 1.
    """
