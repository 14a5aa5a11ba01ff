"""The exception that a user sees, and two kinds of it that callers have to distinguish."""


class UserError(Exception):
    """The work cannot be done, and the user can change that.

    The text is one clear sentence: what is wrong, where (file, line, column, key) and what to do.
    The command line prints it as ``error: ...`` and ends with status 1.
    """


class UsageError(UserError):
    """Wrong words or options of a command, whatever the files hold; the command line ends with status 2."""


class RunsAwayError(UserError):
    """A free run of a model does not stay finite. A comparison still shows the other models."""
