"""The command ``tensegrity``: one file per subcommand.

Exit codes: 0 success, 2 bad usage or input (one line on stderr), 1 an internal failure.
"""

from tensegrity.cli.app import app, main

__all__ = ["app", "main"]
