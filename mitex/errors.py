"""Errors that a user can mend, and warnings about input that was repaired."""


class MitexError(Exception):
    """Something the user can mend; the command line prints it as one `error:` line and exits with code 2.

    Both texts speak to a Python caller. An argument stands in backticks, as `out` or `resume=True`, so that
    the command line can name it as its option.

    Args:
        problem: What is wrong, naming the file, key or value.
        remedy: What to do about it.
    """

    def __init__(self, problem: str, remedy: str):
        super().__init__(problem, remedy)
        self.problem = problem
        self.remedy = remedy

    def __str__(self) -> str:
        return f"{self.problem}; {self.remedy}"


class MeshError(MitexError):
    """A mesh that cannot be read or used."""


class ImageError(MitexError):
    """An image or a map set that cannot be read or used."""


class CaptureError(MitexError):
    """Photos with cameras that cannot be read or used."""


class ConfigError(MitexError):
    """An unknown, ill-typed, out-of-range or contradictory option."""


class OutputError(MitexError):
    """A place that cannot be written to."""


class CheckpointError(MitexError):
    """A run folder, checkpoint or model file that cannot be used."""


class WeightsError(MitexError):
    """Weights of a frozen network are missing or not the expected file."""


class MissingPackage(MitexError):
    """A package of one of Mitex's extras is not installed."""


class RuntimeUnavailable(MitexError):
    """Mitsuba cannot run here: no usable LLVM, or a broken installation."""


class MitexWarning(UserWarning):
    """Something was unusual and has been handled."""


class CaptureWarning(MitexWarning):
    """A capture had flaws that have been handled."""


class MeshWarning(MitexWarning):
    """A mesh had flaws that have been handled."""


class TextureWarning(MitexWarning):
    """A texture that may not look as it was learned."""
