"""What is measured of each result: names, units, which way better lies, and what the numbers mean."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from mitex.evaluation.windows import ELEVATIONS


@dataclass(frozen=True)
class Measure:
    """A number that results have.

    Attributes:
        key: in tables and files.
        label: over a column.
        better: which way better lies, in words; "" for what is neither good nor bad.
        meaning: a sentence or two.
        distance: from the best that is possible, to compare two values by; None if neither is better.
        scale: factor of the value in the report; files have the value itself.
    """

    key: str
    label: str
    better: str
    meaning: str
    distance: Callable[[float], float] | None = abs
    scale: float = 1.0

    @property
    def two_sided(self) -> bool:
        """Whether values lie on both sides of the best one, so that in their mean errors cancel."""
        return self.better in (TO_ZERO, TO_ONE)


def _off_one(value: float) -> float:
    return abs(value - 1)


def _negative(value: float) -> float:
    return -value


HIGHER = "high is better"
LOWER, TO_ZERO, TO_ONE = "low is better", "best is 0", "best is 1"

LOOKS = (
    Measure(
        "frechet_fine",
        "Fréchet, fine",
        LOWER,
        "Fréchet distance between the features of patches of the surface and of the exemplar at relu2_2 of "
        "VGG-16, taken as Gaussians: strokes, grain, colours.",
    ),
    Measure(
        "frechet_coarse",
        "Fréchet, coarse",
        LOWER,
        "The same at relu4_1, whose features see 40 pixels and more: shapes and how they are arranged.",
    ),
    Measure(
        "transport",
        "Transport",
        LOWER,
        "Relaxed optimal transport (MeshNCA, equation 4) between the features of five layers of VGG-16: "
        "whether each detail of one has its like in the other. nca, text2mesh and relief train with it.",
    ),
    Measure(
        "gram",
        "Gram",
        LOWER,
        "Squared distance of the Gram matrices of five layers of VGG-16. surface, gatys, multi_view_gram, "
        "reaction_diffusion, solid_texture and style_mesh train with it.",
    ),
    Measure(
        "seams",
        "Seam ratio",
        TO_ONE,
        "How much more the colours change across the seams of the UV layout than across other edges of the "
        "mesh. 1: seams cannot be seen. Under the mean stands the mean distance from 1, by which methods are "
        "sorted and marked. No network is involved.",
        _off_one,
    ),
    Measure(
        "repetition",
        "Repetition",
        TO_ZERO,
        "The highest peak of the autocorrelation beside the one at no shift, minus that of the exemplar. "
        "Above 0: it repeats more than the exemplar; below: it is less regular. Shifts go up to half the "
        "exemplar's width: whole exemplars laid side by side as tiles are not seen. Under the mean stands "
        "the mean distance from 0, by which methods are sorted and marked. No network is involved.",
    ),
)
TEXTS = (
    Measure(
        "mes_dir",
        "MES-dir",
        HIGHER,
        "Cosine times 100 of the step from the grey object to the textured one, among pictures, and of the "
        "step from its name to the words, among texts (MeshNCA, section G.1). It agrees with people.",
        _negative,
    ),
    Measure(
        "mes",
        "MES",
        HIGHER,
        "Cosine times 100 of the pictures and the words. It rises with patterns that only the model likes. "
        "Both scores are by the judge, a vision-language model: of a method that was trained with it, "
        "they say little.",
        _negative,
    ),
)
RELIEFS = (
    Measure(
        "form",
        "Form",
        LOWER,
        "How a relief looks: Fréchet distance of features of VGG-16 between patches of the surface and of "
        "the reference, pictures of normals and of curvature, straight on and aslant, at the size at which "
        "they are most alike. 0: the reference; 1: as far as a plane.",
    ),
    Measure(
        "form_coarse",
        "Form, coarse",
        LOWER,
        "The same at relu4_1 alone, whose features see 60 pixels of 96: whether whole shapes are right.",
    ),
    Measure(
        "relief_size",
        "Relief size",
        "",
        "That size: how large the relief is beside the mesh, over how large it is beside the reference.",
        None,
    ),
    Measure(
        "piercing",
        "Piercing faces",
        LOWER,
        "Pairs of faces of the surface that pierce each other. The mesh itself may have some.",
    ),
    Measure(
        "dihedral",
        "Dihedral angles",
        LOWER,
        "Wasserstein distance of the distributions of signed angles between neighbouring faces, on the "
        "surface and on the reference [rad]. Meshes of equal density compare best.",
    ),
    Measure(
        "edges",
        "Edge lengths",
        LOWER,
        "The same of edge lengths, relative to their mean.",
    ),
    Measure(
        "curvature",
        "Curvature",
        LOWER,
        "The same of signed mean curvatures at the vertices, times the mean edge length.",
    ),
    Measure(
        "shading",
        "Shading",
        LOWER,
        "Fréchet distance of features at relu2_2 of VGG-16 between four shaded views of the surface and of "
        "the reference, both grey: in the place of SIFID, whose network is another.",
    ),
)
CAPTURES = (
    *(
        Measure(
            f"plane_{angle}",
            f"{angle}°",
            LOWER,
            "Single-image Fréchet distance of features of VGG-16 between photos that see the surface "
            f"{angle} degrees from its normal and pictures of a plane that wears the texture, by the same "
            "cameras.",
        )
        for angle in ELEVATIONS
    ),
    Measure("planes", "Mean of the angles", LOWER, "The mean of these five."),
    Measure(
        "psnr",
        "PSNR [dB]",
        HIGHER,
        "Peak signal-to-noise ratio of the captured object in photos that were held out. Only of textures "
        "that can be seen on it.",
        _negative,
    ),
    Measure("ssim", "SSIM", HIGHER, "Structural similarity of the same; 1 at most.", _negative),
    Measure(
        "vgg",
        "VGG distance",
        LOWER,
        "Distance of the same in features of VGG-16: in the place of LPIPS, whose weights are others.",
    ),
)
COSTS = (
    Measure(
        "parameters",
        "Parameters",
        "",
        "Numbers that the fit optimizes: weights of a network, or texels. 0 where nothing is optimized.",
        None,
    ),
    Measure(
        "fit_seconds",
        "Fit [s]",
        LOWER,
        "Wall time of the fit, with the start of its process; of one that was interrupted, also that of the "
        "attempts before, up to their checkpoints; of a method that learns from another's run, that of both.",
    ),
    Measure(
        "apply_seconds",
        "Synthesis [s]",
        LOWER,
        "Wall time of `mitex apply`: putting it on the mesh and writing the file. Methods that fit to one "
        "mesh synthesize in the fit.",
    ),
    Measure(
        "memory",
        "Memory [GB]",
        LOWER,
        "The most memory that the process of the fit or that of the synthesis had.",
        scale=1e-9,
    ),
)
BY_KEY = {measure.key: measure for measure in (*LOOKS, *TEXTS, *RELIEFS, *CAPTURES, *COSTS)}
