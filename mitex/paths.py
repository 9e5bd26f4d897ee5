"""Where files are written: checks beforehand, and replacement in one step."""

import errno
import os
import re
import secrets
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

from mitex.errors import OutputError

# Names of the temporary files of `atomic_write`, and of those that safetensors makes by itself.
_TEMPORARY = re.compile(r"\..*\.[0-9a-f]{8}\.tmp(\.[^.]*)?|\.tmp[A-Za-z0-9]{6}", re.DOTALL)


def prepare_output(
    path: str | os.PathLike[str],
    suffixes: Sequence[str] = (),
    inputs: Iterable[str | os.PathLike[str] | None] = (),
) -> Path:
    """Checks, before any long work, that a file can be written at `path`. Creates nothing.

    Folders that do not exist yet are allowed when the nearest existing ancestor is writable;
    `atomic_write` makes them.

    Args:
        path: The file to be written; `~` is expanded, and a symbolic link followed: what it points to is
            replaced, and the link stays.
        suffixes: Allowed endings with their dot, in lower case, such as `(".png", ".exr")`; empty allows any.
        inputs: What the work reads, which must not be replaced; names that are no files do not matter.

    Returns:
        The path, absolute.

    Raises:
        OutputError: The suffix is not allowed, a folder, pipe or device has that name, the place is not
            writable, or the file is one of the inputs, be it through a link or in another spelling.
    """
    target = _absolute(path)
    if suffixes and target.suffix.lower() not in suffixes:
        allowed = ", ".join(suffixes)
        ending = f"'{target.suffix}'" if target.suffix else "no suffix"
        raise OutputError(f"cannot write '{path}' with {ending}", f"use one of {allowed}")
    try:
        if target.is_dir():
            raise OutputError(f"'{path}' is a folder", "name a file")
        _check_folder(target.parent)
        _check_regular(target)
        if target.exists() and not os.access(target, os.W_OK):
            raise OutputError(f"'{path}' is write-protected", "change its permissions or name another file")
        if any(_same_file(target, source) for source in inputs if source is not None):
            raise OutputError(f"'{path}' is an input, and would be overwritten", "name another file")
    except OSError as e:
        raise _translated(e, target) from e
    return target


def check_writable(path: str | os.PathLike[str]) -> None:
    """Checks that the folder `path` can be made, or written to if it exists. Creates nothing.

    Raises:
        OutputError: It is a file, or cannot be made or written to.
    """
    target = _absolute(path)
    try:
        _check_folder(target)
    except OSError as e:
        raise _translated(e, target) from e


def prepare_folder(path: str | os.PathLike[str]) -> Path:
    """Makes the folder `path` (and its parents) and checks that it is writable.

    Returns:
        The path, absolute.

    Raises:
        OutputError: It is a file, or cannot be made or written to.
    """
    check_writable(path)
    target = _absolute(path)
    try:
        target.mkdir(parents=True, exist_ok=True)
    except OSError as e:
        raise _translated(e, target) from e
    return target


def check_own_folder(path: str | os.PathLike[str], is_own: Callable[[Path], bool]) -> Path:
    """Checks that the folder `path` is new, empty, or one's own, and can be written to. Creates nothing.

    Temporary files do not count: another call may be about to write what makes the folder one's own.

    Args:
        path: the folder.
        is_own: tells by what is in a folder that one may go on in it.

    Returns:
        The path, absolute.

    Raises:
        OutputError: It holds other files, is a file, or cannot be made or written to.
    """
    check_writable(path)
    folder = Path(os.path.abspath(expanded(path)))
    files = folder.iterdir() if folder.is_dir() else ()
    if not all(map(is_temporary, files)) and not is_own(folder):
        raise OutputError(f"'{path}' holds other files", "name a new or empty folder with `out`")
    return folder


def missing_folders(path: str | os.PathLike[str]) -> list[Path]:
    """Those of the folder `path` and its ancestors that do not exist, outermost first, absolute."""
    folder, missing = _absolute(path), []
    while not folder.exists():
        missing.append(folder)
        folder = folder.parent
    return missing[::-1]


@contextmanager
def atomic_write(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Yields a temporary path beside `path`; on success its file is fsynced and renamed to `path`.

    Readers see the old file or the new one, never a part; a symbolic link stays, and the file that it points
    to is replaced. When the block raises, the temporary file is
    removed and the old file stays. Missing folders are made. The temporary name ends like `path`, since many
    writers choose the format by suffix; the file gets the usual permissions, whatever the writer does.

    Raises:
        OutputError: The operating system refused (disk full, permission, ...), no file was written, or the
            path is a pipe or a device; other errors pass unchanged.
    """
    target = _absolute(path)
    temporary = target.with_name(f".{target.stem[:40]}.{secrets.token_hex(4)}.tmp{target.suffix}")
    created: list[Path] = []
    try:
        _check_regular(target)
        created = missing_folders(target.parent)
        target.parent.mkdir(parents=True, exist_ok=True)
        temporary.touch()
        mode = temporary.stat().st_mode  # safetensors would leave it readable for its owner only
        temporary.unlink()
        yield temporary
        if not temporary.is_file():
            raise OutputError(f"nothing was written to '{target}'", "see the messages above")
        temporary.chmod(mode)
        _sync(temporary)
        os.replace(temporary, target)
        _sync(target.parent)
    except BaseException as e:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)
        for folder in reversed(created):
            with suppress(OSError):
                folder.rmdir()
        if isinstance(e, OSError):
            raise _translated(e, target) from e
        # Writers in other languages (safetensors, OpenEXR) raise their own types with the system's words.
        if isinstance(e, Exception) and os.strerror(errno.ENOSPC) in str(e):
            raise _translated(OSError(errno.ENOSPC, str(e)), target) from e
        raise


@contextmanager
def writing(target: Path) -> Iterator[Path]:
    """Yields the place that is written to within the context.

    Raises:
        OutputError: The operating system refused.
    """
    try:
        yield target
    except OSError as e:
        raise _translated(e, target) from e


def is_temporary(path: Path) -> bool:
    """Whether a file is named as `atomic_write` names its temporary ones: in a killed process they stay."""
    return _TEMPORARY.fullmatch(path.name) is not None and path.is_file()


def expanded(path: str | os.PathLike[str]) -> Path:
    """The path with `~` and `~NAME` replaced by that user's home; a file may also be called `~NAME`.

    `Path.expanduser` raises a RuntimeError where there is no such user.
    """
    return Path(os.path.expanduser(path))


def encodable(name: str) -> str:
    """A file's name as UTF-8 files can hold it: bytes that are none become escapes such as `\\udcff`."""
    return name.encode("utf-8", "backslashreplace").decode("utf-8")


def cache_dir() -> Path:
    """The user's folder for things that Mitex can make again (not created here)."""
    if sys.platform == "darwin":
        base = Path.home() / "Library" / "Caches"
    else:
        base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return base / "mitex"


def _absolute(path: str | os.PathLike[str]) -> Path:
    if not os.fspath(path) or "\0" in os.fspath(path):
        raise OutputError(f"{os.fspath(path)!r} is not a path", "name a file or folder")
    target = os.path.abspath(expanded(path))
    return Path(os.path.realpath(target) if os.path.islink(target) else target)


def _check_regular(target: Path) -> None:
    if target.exists() and not target.is_file():
        raise OutputError(
            f"'{target}' is a pipe or a device, and results are written as a whole", "name a file"
        )


def _same_file(target: Path, source: str | os.PathLike[str]) -> bool:
    try:
        source = expanded(source)
        return source.is_file() and os.path.samefile(target, source)
    except (OSError, ValueError):  # one of them does not exist, or is no path
        return False


def _check_folder(folder: Path) -> None:
    ancestor = folder
    while not ancestor.exists():
        ancestor = ancestor.parent
    if not ancestor.is_dir():
        raise OutputError(f"'{ancestor}' is a file, so nothing can be written below it", "name another place")
    if not os.access(ancestor, os.W_OK | os.X_OK):
        raise OutputError(f"folder '{ancestor}' is not writable", "name another place or change permissions")


def _sync(path: Path) -> None:
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _translated(error: OSError, target: Path) -> OutputError:
    if error.errno in (errno.ENOSPC, errno.EDQUOT):
        return OutputError(f"no space left to write '{target}'", "free some space or name another place")
    if error.errno in (errno.EACCES, errno.EPERM, errno.EROFS):
        return OutputError(f"no permission to write '{target}'", "name another place or change permissions")
    if error.errno == errno.ENAMETOOLONG:
        return OutputError(f"the name of '{str(target)[:80]}...' is too long", "use a shorter one")
    reason = error.strerror or str(error)
    return OutputError(f"could not write '{target}' ({reason})", "check the path and the disk")
