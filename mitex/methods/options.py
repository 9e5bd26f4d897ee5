"""The command-line options that methods share; each method's own are in its `cli.py`."""

from __future__ import annotations

from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from tyro.conf import Positional, UseAppendAction, arg

from mitex.methods.checks import in_range, merged_settings, reject_unused
from mitex.methods.option_types import ExemplarName, PlainText
from mitex.ranges import DISPLACEMENTS, SEEDS
from mitex.suffixes import ASSETS, PICTURES, names_field_file
from mitex.training.settings import RunSettings

if TYPE_CHECKING:
    from mitex.methods.interface import Applied
    from mitex.training.progress import ProgressDisplay

PICTURE_RESOLUTION = 512  # of a radiance field [pixels]


def field_files(*fields: str | None) -> list[str]:
    """The files that options for vector fields name, if they do."""
    return [field for field in fields if field and names_field_file(field)]


@dataclass(kw_only=True)
class FitOptions:
    """Options of every `mitex fit METHOD`.

    Attributes:
        only_at_start: names of options that a run which is resumed does not take again.
        source: name of the option for what it usually learns from, if none of them must be given.
        fits_to_mesh: whether a fit is of one mesh, rather than for any that its texture is put on later.
    """

    only_at_start: ClassVar[frozenset[str]] = frozenset()
    source: ClassVar[str | None] = None
    fits_to_mesh: ClassVar[bool] = False

    out: Annotated[Path | None, arg(metavar="RUN", help_behavior_hint="(default: a folder in runs/)")] = None
    """Run folder."""

    preset: Annotated[PlainText | None, arg(metavar="NAME", help_behavior_hint="")] = None
    """Settings to start from."""

    config: Annotated[Path | None, arg(metavar="FILE", help_behavior_hint="")] = None
    """TOML file with any of the settings, or a run's config.toml."""

    set: Annotated[
        tuple[tuple[str, ...], ...],
        UseAppendAction,
        arg(metavar="KEY=VALUE ...", help_behavior_hint="(repeatable)"),
    ] = ()
    """Any setting."""

    settings: Annotated[bool, arg(help_behavior_hint="")] = False
    """List the settings with their meaning, values in the preset and ranges, and do nothing else."""

    seed: Annotated[int | None, arg(metavar="N", help_behavior_hint="(default: the preset's)")] = None
    """Random seed."""

    quiet: Annotated[bool, arg(help_behavior_hint="")] = False
    """Show no progress."""

    def run(self) -> None:
        """Fits, and prints the run folder."""
        raise NotImplementedError

    def run_options(self, **flags: object) -> RunSettings:
        """Checks the seed and the run folder; what every `fit` takes, with further `flags` as settings."""
        in_range("--seed", self.seed, *SEEDS)
        if self.out is not None:
            from mitex.training import run

            run.check(self.out, resume=getattr(self, "resume", False))
        return RunSettings(
            preset=self.preset,
            config=self.config,
            set=merged_settings(self.set, seed=self.seed, **flags),
        )

    def progress(self) -> AbstractContextManager[ProgressDisplay | None]:
        """What shows the steps, as the `on_step` of a fit; None with --quiet."""
        from mitex.training.progress import ProgressDisplay

        return nullcontext() if self.quiet else ProgressDisplay()

    def folder(self, name: str) -> Path:
        """The run folder: --out, else one of that name in runs/."""
        return self.out or Path("runs") / name


@dataclass(kw_only=True)
class TrainingOptions(FitOptions):
    """Options of the methods that train step by step."""

    resume: Annotated[bool, arg(help_behavior_hint="")] = False
    """Go on from the run's checkpoint."""

    steps: Annotated[int | None, arg(metavar="N", help_behavior_hint="(default: the preset's)")] = None
    """Training steps."""

    def run_options(self, **flags: object) -> RunSettings:
        in_range("--steps", self.steps, 1)
        return {**super().run_options(steps=self.steps, **flags), "resume": self.resume}


@dataclass(kw_only=True)
class DeviceOptions(TrainingOptions):
    """Options of the methods that can train on a graphics card."""

    device: Annotated[
        Literal["cpu", "cuda"] | None, arg(metavar="cpu|cuda", help_behavior_hint="(default: cpu)")
    ] = None
    """Train on the processor, or on the first CUDA graphics card."""

    def run_options(self, **flags: object) -> RunSettings:
        return super().run_options(device=self.device, **flags)


@dataclass(kw_only=True)
class ExemplarOptions(TrainingOptions):
    """Options of the methods that learn from images."""

    exemplar: Annotated[ExemplarName, arg(metavar="IMAGE|DIR|NAME")]
    """PNG or JPEG, a folder with any of albedo, height, normal, roughness, ambient_occlusion, or a name."""


@dataclass(kw_only=True)
class MeshFitOptions(FitOptions):
    """Options of the methods whose textures belong to the mesh that they are learned on."""

    fits_to_mesh: ClassVar[bool] = True

    mesh: Annotated[str, arg(metavar="MESH|NAME")]
    """Mesh file (.obj .ply .stl .glb .gltf .off), or name of an embedded mesh."""

    keep_uvs: Annotated[bool, arg(help_behavior_hint="")] = False
    """Use the mesh's own UVs, which must not overlap."""


@dataclass(kw_only=True)
class ApplyOptions:
    """Options of every `mitex apply RUN|MODEL`."""

    model: Annotated[Positional[str], arg(metavar="RUN|MODEL")]
    """Run folder, model file, or name of a bundled model (see `mitex models`)."""

    out: Annotated[str, arg(metavar="ASSET|PAGE|PICTURE|DIR/")]
    """File to write: .glb (PBR textures), .obj (with .mtl and PNG maps), .ply (vertex colours), .exr (the
    maps as layers), .html (a page for any browser, in which an automaton's texture grows), or a picture
    (.png .jpg). A folder, which exists or ends with a slash, gets each map as a file, and mesh.obj."""

    maps_format: Annotated[Literal["png", "exr"], arg(metavar="png|exr")] = "png"
    """Format of the maps in a folder."""

    quiet: Annotated[bool, arg(help_behavior_hint="")] = False
    """Show no progress."""

    def run(self) -> None:
        """Applies the texture, writes the file, and prints its path."""
        self.check()
        out = self.output_path()
        self.check_output(out)
        self.write(out)
        print(self.out)

    def output_path(self) -> Path:
        """--out as an absolute path, once it is sure that it can be written."""
        from mitex.export import is_folder, prepare_export

        out = prepare_export(self.out, ASSETS + PICTURES, self.inputs(), self.maps_format)
        reject_unused("--maps-format", out, self.maps_format == "exr" and not is_folder(self.out))
        return out

    def write(self, out: Path) -> None:
        """Applies the texture and writes it to `out`, which has been checked."""
        applied = self.finish(self.applied(out))
        if out.suffix.lower() in PICTURES:
            applied.render(out, **self.picture_options())
        else:
            applied.export(self.out, self.maps_format)

    def finish(self, applied: Applied) -> Applied:
        """What is done to the textured mesh before it is written."""
        return applied

    def check(self) -> None:
        """Refuses values out of range, before anything is read."""

    def inputs(self) -> list[Path | str]:
        """What is read, and must not be overwritten: the model, and whatever file an option names."""
        files = [value for name, value in vars(self).items() if name != "out" and isinstance(value, Path)]
        return [self.model, *files]

    def check_output(self, out: Path) -> None:
        """Refuses options that mean nothing for a file of this suffix."""

    def picture_options(self) -> dict[str, object]:
        """Options of `Applied.render`."""
        return {}

    def applied(self, out: Path) -> Applied:
        """The texture on the mesh, as `out` needs it."""
        raise NotImplementedError


@dataclass(kw_only=True)
class OptionalMeshOptions(ApplyOptions):
    """Options of the methods that make maps without a mesh, too."""

    mesh: Annotated[str | None, arg(metavar="MESH|NAME", help_behavior_hint="")] = None
    """Mesh file (.obj .ply .stl .glb .gltf .off), or name of an embedded mesh."""

    def inputs(self) -> list[Path | str]:
        from mitex.mesh.files import mesh_files

        return [*super().inputs(), *([] if self.mesh is None else mesh_files(self.mesh))]


@dataclass(kw_only=True)
class MeshOptions(ApplyOptions):
    """Options of the methods that put a texture on a mesh of the user's."""

    mesh: Annotated[str, arg(metavar="MESH|NAME")]
    """Mesh file (.obj .ply .stl .glb .gltf .off), or name of an embedded mesh."""

    def inputs(self) -> list[Path | str]:
        from mitex.mesh.files import mesh_files

        return [*super().inputs(), *mesh_files(self.mesh)]


@dataclass(kw_only=True)
class ReliefOptions(OptionalMeshOptions):
    """Options of the methods that may make a height map."""

    relief: Annotated[float | None, arg(metavar="X", help_behavior_hint="")] = None
    """Depth of the relief that the height map becomes on the mesh itself, which is made finer [radii of the
    mesh]; 0.05 is much."""

    def check(self) -> None:
        in_range("--relief", self.relief, *DISPLACEMENTS)

    def finish(self, applied: Applied) -> Applied:
        if self.relief is None:
            return applied
        from mitex.asset import Asset
        from mitex.export import embossed

        assert isinstance(applied, Asset)
        return embossed(applied, self.relief)


@dataclass(kw_only=True)
class FieldOptions(ApplyOptions):
    """Options of the methods that make radiance fields, of which pictures are made without a mesh of them."""

    resolution: Annotated[
        int | None, arg(metavar="N", help_behavior_hint=f"(default: {PICTURE_RESOLUTION})")
    ] = None
    """Side of a picture [pixels]."""

    def check(self) -> None:
        in_range("--resolution", self.resolution, 64, 8192)

    def check_output(self, out: Path) -> None:
        picture = out.suffix.lower() in PICTURES
        reject_unused("--resolution", out, self.resolution is not None and not picture)

    def picture_options(self) -> dict[str, object]:
        return {"resolution": self.resolution or PICTURE_RESOLUTION}
