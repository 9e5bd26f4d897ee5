"""Films that take a while: frames are kept beside the film until it is whole, so that it can be resumed."""

from __future__ import annotations

import json
import logging
import os
import shutil
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from mitex.errors import ConfigError, OutputError
from mitex.images import read_image, to_bytes
from mitex.paths import atomic_write, check_writable, expanded, prepare_output
from mitex.progress import announce, counted
from mitex.render.loop import Loop, best_loop
from mitex.render.video import VIDEO_SUFFIXES, check_video, write_video
from mitex.runtime.signals import StopSignals

log = logging.getLogger(__name__)

SETTINGS = "film.json"
SMALL = 32  # side of the pictures that the search for a loop compares [px]
SHORTEST = 0.5  # of a loop, in lengths of the film that was asked for


@dataclass(frozen=True)
class Recording:
    """A film to be made.

    Attributes:
        target: .mp4, .gif, or a folder of frames.
        frames: how many it has; of a loop, at most.
        fps: frames a second.
        side: of its pictures [px].
        settings: all that its pictures follow from, as JSON values.
        fade: frames over which a loop fades; None for a film that just ends.
    """

    target: Path
    frames: int
    fps: int
    side: int
    settings: Mapping[str, Any]
    fade: int | None = None

    @staticmethod
    def of(
        path: str | os.PathLike[str],
        frames: int,
        fps: int,
        side: int,
        settings: Mapping[str, Any],
        fade: int | None = None,
    ) -> Recording:
        """Checks all that can be checked before; makes nothing.

        Raises:
            OutputError: the path is neither .mp4 nor .gif nor a folder, or not writable; or a folder that
                holds something.
            ConfigError: a number out of range, or an odd side for .mp4.
        """
        target = _checked_target(path, frames, fps, side)
        if fade is not None and not 0 <= fade <= frames // 2:
            raise ConfigError(f"a cross-fade of {fade} frames", f"use 0 to {frames // 2} in this film")
        return Recording(target, frames, fps, side, settings, fade)

    @property
    def folder(self) -> Path:
        """Where frames are kept until the film is whole."""
        return self.target.with_name(f".{self.target.name}.frames")

    @property
    def pictures(self) -> int:
        """How many pictures it takes: for a loop, some more than it shows."""
        return self.frames if self.fade is None else self.frames + max(self.fade, 1) + self.frames // 4

    def record(self, pictures: Callable[[int], Iterable[np.ndarray]], resume: bool = False) -> Path:
        """Makes the film.

        Args:
            pictures: from the number of pictures that are there already to those that follow, (H, W, 3) sRGB
                in [0, 1] each.
            resume: go on with a film that was interrupted.

        Returns:
            The target.

        Raises:
            OutputError: the place is not writable, or there is nothing to resume.
            ConfigError: what is to be resumed had other settings.
            KeyboardInterrupt: a signal stopped it after a whole picture; the message says how to go on.
        """
        done = self._begin(resume)
        if done < self.pictures:
            self._film(counted("filming", pictures(done), self.pictures, done), done)
        self._assemble()
        shutil.rmtree(self.folder)
        return self.target

    def _begin(self, resume: bool) -> int:
        """The number of pictures that are there."""
        file = self.folder / SETTINGS
        settings = json.loads(json.dumps({**self.settings, "resolution": self.side}))
        if not resume:
            if self.folder.exists() and not file.is_file():
                raise OutputError(f"'{self.folder}' is in the way, and not of an interrupted film", "move it")
            shutil.rmtree(self.folder, ignore_errors=True)
            with atomic_write(file) as temporary:
                temporary.write_text(json.dumps(settings), encoding="utf-8")
            return 0
        try:
            before = json.loads(file.read_text(encoding="utf-8"))
        except (OSError, ValueError) as e:
            raise OutputError(
                f"there is no interrupted film '{self.target.name}' to resume",
                "start without `resume=True`",
            ) from e
        differing = [key for key in settings | before if settings.get(key) != before.get(key)]
        if differing:
            raise ConfigError(
                f"the interrupted film had another {' and '.join(differing)}",
                "resume with the same, or start without `resume=True`",
            )
        return next(k for k in range(self.pictures + 1) if k == self.pictures or not self._place(k).is_file())

    def _film(self, pictures: Iterator[np.ndarray], done: int) -> None:
        with StopSignals() as stop:
            try:
                for picture in pictures:
                    with atomic_write(self._place(done)) as temporary:
                        Image.fromarray(to_bytes(picture)).save(temporary, "PNG")
                    done += 1
                    if stop.requested and done < self.pictures:
                        raise KeyboardInterrupt
            except KeyboardInterrupt:
                raise KeyboardInterrupt(
                    f"interrupted after {done} of {self.pictures} frames, which are kept; go on with "
                    f"`resume=True` and otherwise the same options"
                ) from None

    def _assemble(self) -> None:
        pictures, count = map(self._read, range(self.frames)), self.frames
        if self.fade is not None:
            loop = self._loop(self.fade)
            pictures, count = loop.pictures(self._read), loop.length
            log.info(
                "a loop of %.2f s; its ends differ by %.1f %% before they fade",
                count / self.fps,
                100 * loop.difference,
            )
        if self.target.suffix.lower() in VIDEO_SUFFIXES:
            write_video(self.target, pictures, count, self.fps, self.side, work="writing the film")
        else:
            self._write_folder(pictures, count)

    def _loop(self, fade: int) -> Loop:
        announce("looking for a loop")
        small = [np.asarray(Image.open(self._place(k)).resize((SMALL, SMALL))) for k in range(self.pictures)]
        shortest = max(round(SHORTEST * self.frames), fade, 2)
        return best_loop(np.stack(small) / 255.0, fade, shortest, self.frames)

    def _write_folder(self, pictures: Iterable[np.ndarray], count: int) -> None:
        """All frames at once: a hidden folder gets the name of the target when it is full."""
        whole = self.folder / "whole"
        shutil.rmtree(whole, ignore_errors=True)
        whole.mkdir()
        for k, picture in enumerate(counted("writing the frames", pictures, count)):
            Image.fromarray(to_bytes(picture)).save(whole / f"{k:04}.png")
        os.replace(whole, self.target)

    def _place(self, frame: int) -> Path:
        return self.folder / f"{frame:04}.png"

    def _read(self, frame: int) -> np.ndarray:
        return read_image(self._place(frame))


def _checked_target(path: str | os.PathLike[str], frames: int, fps: int, side: int) -> Path:
    place = expanded(path)
    suffix = place.suffix.lower()
    if suffix in (".glb", ".gltf"):
        raise OutputError(
            f"'{path}' cannot hold a film: glTF moves shapes, and its variants are looks to choose from, not "
            "a sequence in time",
            "write .mp4, .gif or a folder of frames",
        )
    if suffix in VIDEO_SUFFIXES:
        return check_video(path, frames, fps, side)
    if suffix and not os.fspath(path).endswith("/") and not place.is_dir():
        prepare_output(path, VIDEO_SUFFIXES)
    check_video(place.with_name(f"{place.name}.gif"), frames, fps, side)
    if place.is_dir() and any(place.iterdir()):
        raise OutputError(f"folder '{path}' is not empty", "name a new one")
    check_writable(place)
    return Path(os.path.realpath(place))
