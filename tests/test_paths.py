"""Checks before writing, and files that are replaced in one step or not at all."""

import errno
import os
from pathlib import Path

import pytest

from mitex import paths
from mitex.errors import ConfigError, OutputError
from mitex.paths import (
    atomic_write,
    cache_dir,
    check_own_folder,
    expanded,
    is_temporary,
    prepare_folder,
    prepare_output,
)

needs_permissions = pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")


def listing(folder: Path) -> list[str]:
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*"))


def test_prepare_output_makes_nothing_and_answers_absolute(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    assert prepare_output("new/folder/a.PNG", (".png", ".exr")) == tmp_path / "new/folder/a.PNG"
    monkeypatch.setenv("HOME", str(tmp_path))
    assert prepare_output("~/b.glb", (".glb",)) == tmp_path / "b.glb"
    assert listing(tmp_path) == []


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("a.jpg", "'.jpg'; use one of .png, .exr"),
        ("a", "no suffix; use one of .png, .exr"),
        ("folder.png", "is a folder"),
        ("file/a.png", "'{}/file' is a file"),
        ("file/deeper/a.png", "'{}/file' is a file"),
        ("x" * 300 + ".png", "too long"),
        ("a\0.png", "not a path"),
        ("", "not a path"),
    ],
)
def test_prepare_output_refuses(tmp_path: Path, name: str, words: str):
    (tmp_path / "folder.png").mkdir()
    (tmp_path / "file").touch()
    with pytest.raises(OutputError) as error:
        prepare_output(f"{tmp_path}/{name}" if name else "", (".png", ".exr"))
    assert words.format(tmp_path) in str(error.value)


@pytest.mark.parametrize(
    "prepare", [prepare_output, prepare_folder, lambda path: check_own_folder(path, lambda folder: True)]
)
def test_places_without_permission_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, prepare):
    monkeypatch.setattr(os, "access", lambda path, mode: Path(path) != tmp_path)
    with pytest.raises(OutputError, match="not writable"):
        prepare(tmp_path / "new" / "place")


def test_a_protected_file_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    target = tmp_path / "a.png"
    target.touch()
    monkeypatch.setattr(os, "access", lambda path, mode: Path(path) != target)
    with pytest.raises(OutputError, match="write-protected"):
        prepare_output(target)


@pytest.mark.parametrize(
    "spelling", ["mesh.obj", "sub/../mesh.obj", "soft.obj", "hard.obj", "folder/mesh.obj"]
)
def test_an_output_that_is_an_input_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, spelling: str
):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "sub").mkdir()
    source = tmp_path / "mesh.obj"
    source.write_text("v 0 0 0")
    (tmp_path / "soft.obj").symlink_to("mesh.obj")
    (tmp_path / "hard.obj").hardlink_to("mesh.obj")
    (tmp_path / "folder").symlink_to(".")
    for inputs in ([source], [None, "vase", "mesh.obj"], [tmp_path / "soft.obj"]):
        with pytest.raises(OutputError, match=rf"'{spelling}' is an input.*; name another file"):
            prepare_output(spelling, (".obj",), inputs)
    assert source.read_text() == "v 0 0 0"


def test_an_input_in_another_spelling_is_refused(tmp_path: Path):
    """On a file system that does not tell cases apart, both names lead to one file."""
    (tmp_path / "Mesh.obj").touch()
    (tmp_path / "mesh.OBJ").hardlink_to(tmp_path / "Mesh.obj")
    with pytest.raises(OutputError, match="is an input"):
        prepare_output(tmp_path / "mesh.OBJ", (".obj",), [tmp_path / "Mesh.obj"])


def test_other_files_than_the_inputs_may_be_replaced(tmp_path: Path):
    for name in ("in.obj", "out.obj"):
        (tmp_path / name).touch()
    inputs = [tmp_path / "in.obj", tmp_path, tmp_path / "missing.obj", "a\0b", None]
    for name in ("out.obj", "new.obj"):
        assert prepare_output(tmp_path / name, inputs=inputs) == tmp_path / name


@needs_permissions
def test_real_permissions_are_respected(tmp_path: Path):
    tmp_path.chmod(0o500)
    with pytest.raises(OutputError, match="not writable"):
        prepare_output(tmp_path / "a.png")
    with pytest.raises(OutputError, match="no permission"), atomic_write(tmp_path / "a.png") as temporary:
        temporary.write_text("x")


def test_prepare_folder(tmp_path: Path):
    assert prepare_folder(tmp_path / "a/b").is_dir()
    assert prepare_folder(tmp_path / "a/b") == tmp_path / "a/b"
    (tmp_path / "file").touch()
    with pytest.raises(OutputError, match="is a file"):
        prepare_folder(tmp_path / "file")


@pytest.mark.parametrize(
    ("names", "accepted"),
    [([], True), ([".a.0123abcd.tmp.json"], True), (["thesis.txt"], False), (["thesis.txt", "mine"], True)],
)
def test_a_folder_of_ones_own(tmp_path: Path, names: list[str], accepted: bool):
    folder = tmp_path / "out"
    assert check_own_folder(f"{folder}/", lambda path: False) == folder and not folder.exists()
    folder.mkdir()
    for name in names:
        (folder / name).touch()
    if accepted:
        assert check_own_folder(folder, lambda path: (path / "mine").exists()) == folder
    else:
        with pytest.raises(OutputError, match="'.*out' holds other files; name a new or empty folder"):
            check_own_folder(folder, lambda path: (path / "mine").exists())
    assert listing(folder) == sorted(names)


def test_the_old_file_stays_until_the_block_ends(tmp_path: Path):
    target = tmp_path / "a.png"
    target.write_text("old")
    with atomic_write(target) as temporary:
        assert temporary.parent == target.parent and temporary.suffix == ".png"
        temporary.write_text("new")
        assert target.read_text() == "old"
    assert target.read_text() == "new" and listing(tmp_path) == ["a.png"]


@pytest.mark.parametrize("error", [ValueError("bad"), KeyboardInterrupt(), ConfigError("bad", "mend it")])
def test_an_error_leaves_the_old_file_and_nothing_else(tmp_path: Path, error: BaseException):
    target = tmp_path / "a.png"
    target.write_text("old")
    with pytest.raises(type(error)) as info, atomic_write(target) as temporary:
        temporary.write_text("half")
        raise error
    assert info.value is error
    assert target.read_text() == "old" and listing(tmp_path) == ["a.png"]


def test_folders_made_for_a_failed_write_are_removed(tmp_path: Path):
    with pytest.raises(ValueError), atomic_write(tmp_path / "new/deep/a.png") as temporary:
        temporary.write_text("half")
        raise ValueError
    assert listing(tmp_path) == []


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (OSError(errno.ENOSPC, os.strerror(errno.ENOSPC)), "no space left"),
        (OSError(errno.EDQUOT, os.strerror(errno.EDQUOT)), "no space left"),
        (RuntimeError("I/O error: No space left on device (os error 28)"), "no space left"),
        (OSError(errno.EROFS, os.strerror(errno.EROFS)), "no permission"),
        (OSError(errno.EIO, os.strerror(errno.EIO)), "Input/output error"),
        (OSError("encoder error -2"), "encoder error -2"),
    ],
)
def test_the_systems_refusals_become_output_errors(tmp_path: Path, error: Exception, words: str):
    with pytest.raises(OutputError, match=words), atomic_write(tmp_path / "a.png") as temporary:
        temporary.write_text("half")
        raise error
    assert listing(tmp_path) == []


def test_a_real_full_disk(tmp_path: Path):
    """`/dev/full` answers every write as a full disk does."""
    if not Path("/dev/full").exists():
        pytest.skip("no /dev/full here")
    with pytest.raises(OutputError, match="no space left"), atomic_write(tmp_path / "a.png") as temporary:
        temporary.symlink_to("/dev/full")
        temporary.write_text("too much")
    assert listing(tmp_path) == []


def test_a_writer_that_writes_nothing_is_an_error(tmp_path: Path):
    with pytest.raises(OutputError, match="nothing was written"), atomic_write(tmp_path / "a.png"):
        pass


def test_the_file_is_synced_before_it_gets_its_name_and_the_folder_after(tmp_path: Path, monkeypatch):
    events = []
    real_replace, real_sync = os.replace, paths._sync
    monkeypatch.setattr(os, "replace", lambda a, b: (events.append("rename"), real_replace(a, b)))
    monkeypatch.setattr(
        paths, "_sync", lambda p: (events.append("folder" if p.is_dir() else "file"), real_sync(p))
    )
    with atomic_write(tmp_path / "a.png") as temporary:
        temporary.write_text("x")
    assert events == ["file", "rename", "folder"]


@pytest.mark.parametrize("name", ["a.png", "no_suffix", ".hidden", "ü" * 120 + ".png", "two.dots.tar"])
def test_temporary_files_are_recognised(tmp_path: Path, name: str):
    with atomic_write(tmp_path / name) as temporary:
        assert not is_temporary(temporary)  # a file, that is
        temporary.write_text("x")
        assert is_temporary(temporary)
    assert not is_temporary(tmp_path / name)


def test_long_names_can_be_written(tmp_path: Path):
    name = "ü" * 120 + ".png"
    with atomic_write(tmp_path / name) as temporary:
        temporary.write_text("x")
    assert listing(tmp_path) == [name]


def test_cache_dir_follows_the_users_setting(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(paths.sys, "platform", "linux")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert cache_dir() == tmp_path / "mitex"
    monkeypatch.delenv("XDG_CACHE_HOME")
    monkeypatch.setenv("HOME", str(tmp_path))
    assert cache_dir() == tmp_path / ".cache" / "mitex"


def test_names_that_begin_with_a_tilde(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """`~` is a home; without such a user, `~NAME` is a file like any other."""
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    assert expanded("~/a.png") == tmp_path / "a.png"
    assert expanded("~nobody-of-this-name.png") == Path("~nobody-of-this-name.png")
    assert prepare_output("~nobody-of-this-name.png") == tmp_path / "~nobody-of-this-name.png"


def test_a_link_stays_and_what_it_points_to_is_replaced(tmp_path: Path):
    (tmp_path / "there").mkdir()
    file, link = tmp_path / "there" / "a.txt", tmp_path / "link.txt"
    for _ in range(2):  # the first time it points to nothing yet
        link.unlink(missing_ok=True)
        link.symlink_to(file)
        assert prepare_output(link) == file
        with atomic_write(link) as temporary:
            temporary.write_text("new")
        assert link.is_symlink() and file.read_text() == "new"
    assert listing(tmp_path / "there") == ["a.txt"]


def test_pipes_and_devices_are_refused(tmp_path: Path):
    os.mkfifo(tmp_path / "pipe.txt")
    for place in (tmp_path / "pipe.txt", Path(os.devnull)):
        with pytest.raises(OutputError, match="pipe or a device"):
            prepare_output(place)
        with pytest.raises(OutputError, match="pipe or a device"), atomic_write(place):
            pass
        assert not place.is_file()
