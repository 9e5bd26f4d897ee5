"""The `mitex` command. Nothing heavy is imported before a command needs it."""

from mitex.cli.entry import main

__all__ = ["main"]
