"""`mitex animate` for automata's textures."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, Literal

from tyro.conf import Positional, arg

from mitex.errors import ConfigError
from mitex.methods.checks import in_range
from mitex.methods.nca.growth_options import GrowthOptions
from mitex.methods.nca.ranges import MOST_STEPS
from mitex.ranges import FRAME_RATES, PIXELS, SAMPLES, TURNS, elevations
from mitex.suffixes import VIDEOS

FADE = 12  # frames over which a loop fades
SPP = 32  # of the path tracer


@dataclass(kw_only=True)
class Animate(GrowthOptions):
    """Film a texture as it grows on a mesh, goes on changing (--start), or heals (--damage).

    Frames are kept in a hidden folder beside the film until it is whole: Ctrl-C keeps them, --resume goes on.

    examples:
      mitex animate pebbles --mesh bunny.obj --out growth.mp4
      mitex animate pebbles --mesh bunny.obj --out loop.gif --loop --seconds 3 --resolution 256
      mitex animate pebbles --mesh bunny.obj --out healing.mp4 --damage 0,0.5,0,0.3
      mitex animate pebbles --mesh bunny.obj --out frames/ --renderer path --spp 64
      mitex animate lava --mesh bunny.obj --out flow.mp4 --start 200 --field about-y --speed 1.5
      mitex animate lava --mesh bunny.obj --out both.mp4 --graft shells --weights y
      mitex animate pebbles --mesh bunny.obj --out growth.mp4 --resume
    """

    model: Annotated[Positional[str], arg(metavar="RUN|MODEL")]
    """Run folder, model file, or name of a bundled model (see `mitex models`)."""

    mesh: Annotated[str, arg(metavar="MESH|NAME")]
    """Mesh file (.obj .ply .stl .glb .gltf .off), or name of an embedded mesh."""

    out: Annotated[str, arg(metavar="FILE|DIR/")]
    """Film to write (.mp4 .gif), or a new folder for its frames as PNG."""

    seconds: Annotated[float, arg(metavar="S")] = 4.0
    """Length; a loop may be shorter."""

    fps: Annotated[int, arg(metavar="N")] = 24
    """Frames a second."""

    steps_per_frame: Annotated[int, arg(metavar="N")] = 2
    """Steps of the automaton from frame to frame."""

    start: Annotated[
        int | None,
        arg(metavar="N", help_behavior_hint="(default: 0; the model's steps for --loop and --damage)"),
    ] = None
    """Steps of the automaton before the first frame."""

    renderer: Literal["preview", "path"] = "preview"
    """`preview`: direct light, a fraction of a second a frame; `path`: path-traced, seconds a frame."""

    resolution: Annotated[int, arg(metavar="N")] = 384
    """Width and height [pixels]."""

    spp: Annotated[int | None, arg(metavar="N", help_behavior_hint=f"(default: {SPP})")] = None
    """Samples a pixel, with --renderer path."""

    azimuth: Annotated[float, arg(metavar="DEG")] = 25.0
    """Side from which the mesh is seen [degrees]; 0 is +z, 90 is +x."""

    elevation: Annotated[float, arg(metavar="DEG")] = 18.0
    """How high the camera stands [degrees]."""

    loop: Annotated[bool, arg(help_behavior_hint="")] = False
    """Cut the film where its end resembles its beginning, and fade from one into the other."""

    fade: Annotated[int | None, arg(metavar="N", help_behavior_hint=f"(default: {FADE})")] = None
    """Frames over which a loop fades."""

    damage: Annotated[str | None, arg(metavar="X,Y,Z,R|AXIS:LOW:HIGH", help_behavior_hint="")] = None
    """Erase a region, to see it grow again: a ball, or what is between two heights along an
    axis [mesh units]; y:0: is the half above 0."""

    damage_at: Annotated[float | None, arg(metavar="S", help_behavior_hint="(default: 0.5)")] = None
    """When [seconds]."""

    graft: Annotated[str | None, arg(metavar="RUN|MODEL", help_behavior_hint="")] = None
    """A second texture of the same family, as of `mitex graft`."""

    weights: Annotated[str | None, arg(metavar="W", help_behavior_hint="")] = None
    """Where it is, as of `mitex graft`."""

    resume: Annotated[bool, arg(help_behavior_hint="")] = False
    """Go on with a film that was interrupted."""

    quiet: Annotated[bool, arg(help_behavior_hint="")] = False
    """Show no progress."""

    def run(self) -> None:
        self._check()
        from mitex.mesh.files import mesh_files
        from mitex.paths import prepare_output
        from mitex.runtime import let_idle_threads_sleep

        let_idle_threads_sleep()
        from mitex.methods.nca.film import FilmSettings

        target = FilmSettings(**self._settings()).recording(self.out, {}).target
        if target.suffix.lower() in VIDEOS:
            prepare_output(target, inputs=[*mesh_files(self.mesh), *self._inputs()])
        from mitex.mesh import Mesh
        from mitex.methods.nca import NcaTexture
        from mitex.methods.nca.grafting import grafted

        mesh = Mesh.load(self.mesh)
        if self.graft is None or self.weights is None:
            texture = NcaTexture.load(self.model)
        else:
            texture = grafted(self.model, self.graft, mesh, self.weights)
        texture.animate(
            mesh,
            self.out,
            resume=self.resume,
            seed=self.seed,
            **self.growth(),
            **self._settings(),
        )
        print(self.out)

    def _check(self) -> None:
        self.check_growth()
        in_range("--seconds", self.seconds, 0.0, 3600.0)
        in_range("--fps", self.fps, *FRAME_RATES)
        in_range("--steps-per-frame", self.steps_per_frame, 1, MOST_STEPS)
        in_range("--start", self.start, 0, MOST_STEPS)
        in_range("--resolution", self.resolution, *PIXELS)
        in_range("--spp", self.spp, *SAMPLES)
        in_range("--azimuth", self.azimuth, *TURNS)
        in_range("--elevation", self.elevation, *elevations(self.renderer == "preview"))
        in_range("--damage-at", self.damage_at, 0.0, 3600.0)
        for option, needed, alone in (
            ("--spp", "--renderer path", self.spp is not None and self.renderer != "path"),
            ("--fade", "--loop", self.fade is not None and not self.loop),
            ("--damage-at", "--damage", self.damage_at is not None and self.damage is None),
            ("--graft", "--weights", self.graft is not None and self.weights is None),
            ("--weights", "--graft", self.weights is not None and self.graft is None),
        ):
            if alone:
                raise ConfigError(f"{option} means nothing without {needed}", "give both or neither")

    def _inputs(self) -> list[str]:
        """Models, and the files that options name."""
        named = (self.model, self.graft, self.weights)
        return [*(name for name in named if name is not None), *self.growth_files()]

    def _settings(self) -> dict[str, Any]:
        """Arguments of `FilmSettings`."""
        same = (
            "seconds",
            "fps",
            "steps_per_frame",
            "start",
            "renderer",
            "resolution",
            "azimuth",
            "elevation",
        )
        options = {name: getattr(self, name) for name in (*same, "damage")}
        options |= {"loop": (FADE if self.fade is None else self.fade) if self.loop else None}
        further = {"spp": self.spp, "damage_at": self.damage_at}
        return options | {name: value for name, value in further.items() if value is not None}
