"""What a method of texture synthesis is: the one object by which everything else knows it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, Field, dataclass, field, fields
from typing import TYPE_CHECKING

from mitex.lazy import load

if TYPE_CHECKING:
    from mitex.methods.interface import Texture
    from mitex.methods.options import ApplyOptions, FitOptions
    from mitex.training.settings import FitConfig


@dataclass(frozen=True)
class Method:
    """A method, described without importing it: "module:name" stands for what is imported on first use.

    Attributes:
        name: as in `mitex fit NAME`, in model files and in run folders.
        title: its line in the overview.
        presets: reference to its presets, name -> config; the first one is the default.
        fit, apply: references to the dataclasses of its options, a `FitOptions` and an `ApplyOptions`.
        texture: reference to its `Texture`.
        animate: reference to the options of `mitex animate`, for textures that grow or change.
        page: reference to a function from names of its models and from meshes to what a page shows
            (`mitex.page.Content`), for textures that live in a browser.
        example: reference to a function from a texture to an asset that shows it in the gallery, for textures
            that do not live in a browser.
        commands: further commands of its own: word -> reference to the dataclass of the options, and the line
            in the overview.
        tensors: names of the tensors in weights that the authors published: such files tell nothing else of
            their method.
        baseline: whether other methods are compared with it, rather than it being one to use.
    """

    name: str
    title: str
    presets: str
    fit: str
    apply: str
    texture: str
    animate: str | None = None
    page: str | None = None
    example: str | None = None
    commands: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    tensors: frozenset[str] = frozenset()
    baseline: bool = False

    def load_presets(self) -> Mapping[str, FitConfig]:
        """The presets, name -> config; the first one is the default."""
        return load(self.presets)

    def load_fit(self) -> type[FitOptions]:
        """The dataclass of the options of `mitex fit`."""
        return load(self.fit)

    def load_apply(self) -> type[ApplyOptions]:
        """The dataclass of the options of `mitex apply`."""
        return load(self.apply)

    def load_texture(self) -> type[Texture]:
        """The class of its textures."""
        return load(self.texture)

    @property
    def learns_from(self) -> str:
        """The option of `mitex fit` that names what it learns from: the one that must be given, if any,
        besides the mesh that a fit is of.
        """
        fit = self.load_fit()
        target = {"mesh"} if fit.fits_to_mesh else set()
        return fit.source or next(
            one.name for one in fields(fit) if _is_required(one) and one.name not in target
        )

    @property
    def fits_to_mesh(self) -> bool:
        """Whether a fit is of one mesh, rather than for any that its texture is put on later."""
        return self.load_fit().fits_to_mesh

    @property
    def resumes(self) -> bool:
        """Whether its fits can go on from a checkpoint."""
        return any(one.name == "resume" for one in fields(self.load_fit()))

    @property
    def applies_to_meshes(self) -> bool:
        """Whether `mitex apply` puts its textures on a mesh."""
        return any(one.name == "mesh" for one in fields(self.load_apply()))

    def recognises(self, tensors: frozenset[str], metadata: Mapping[str, str]) -> bool:
        """Whether a safetensors file with these tensors and metadata is one of this method's.

        A model file's format is mitex-METHOD-VERSION; a checkpoint names its method.
        """
        if "task.method" in metadata:
            return metadata["task.method"] == self.name
        if metadata.get("format", "").startswith("mitex-"):
            return metadata["format"].removeprefix("mitex-").rpartition("-")[0] == self.name
        return bool(self.tensors) and tensors == self.tensors


def _is_required(option: Field) -> bool:
    return option.default is MISSING and option.default_factory is MISSING
