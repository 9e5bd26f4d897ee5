"""The report of `mitex doctor`: what Mitex needs, whether it works here, and what mends it."""

import subprocess
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module

from mitex.errors import MitexError, RuntimeUnavailable
from mitex.runtime import cores, llvm, precision, session


@dataclass(frozen=True)
class Check:
    """One line of the report; `fix` is empty when `ok`."""

    name: str
    ok: bool
    detail: str
    fix: str = ""


def doctor() -> list[Check]:
    """Tries everything that Mitex needs, each on its own. Never raises; takes a few seconds."""
    checks: dict[str, tuple[Callable[[], str], str]] = {
        "LLVM": (_llvm, llvm.REMEDY),
        "Mitsuba": (_mitsuba, "reinstall it: `pip install --force-reinstall 'mitsuba>=3.9,<3.10'`"),
        "Dr.Jit": (_drjit, "mend LLVM and Mitsuba first"),
        "cores": (_cores, ""),
        "torch": (_torch, "reinstall it: `pip install --force-reinstall 'torch>=2.13,<2.14'`"),
        "bfloat16": (_bfloat16, f"unset {precision.VARIABLE}"),
        "CUDA": (_cuda, ""),
        "weights": (_weights, "reinstall Mitex"),
        "ffmpeg": (_ffmpeg, "reinstall it: `pip install --force-reinstall imageio-ffmpeg`"),
    }
    return [_check(name, run, fix) for name, (run, fix) in checks.items()]


def _check(name: str, run: Callable[[], str], fix: str) -> Check:
    try:
        return Check(name, True, run())
    except MitexError as e:
        # The reason stands in the line of LLVM or Mitsuba.
        repeated = name == "Dr.Jit" and isinstance(e, RuntimeUnavailable)
        return Check(name, False, "cannot start" if repeated else e.problem, fix if repeated else e.remedy)
    except Exception as e:
        problem = " ".join(f"{type(e).__name__}: {e}".split())
        return Check(name, False, problem[:300], fix)


def _llvm() -> str:
    library, verdict = llvm.find_llvm()
    return f"{verdict.version} ({library.origin}) at {library.path}"


def _mitsuba() -> str:
    mi = session.load_mitsuba(needs_llvm=False)
    return f"{mi.__version__}, {len(mi.variants())} variants, in use: {mi.variant() or 'none yet'}"


def _drjit() -> str:
    """Also runs a kernel; `init` has refused the libraries that would end the process here."""
    mi = session.init()
    dr = import_module("drjit")
    if not mi.variant().startswith("scalar"):
        value = dr.sum(dr.minimum(dr.arange(mi.Float, 16), 3.5))[0]
        if value != 48.0:
            raise ArithmeticError(f"a test kernel gave {value} instead of 48")
    number = ".".join(map(str, dr.detail.llvm_version()))
    return f"{dr.__version__}, LLVM {number}, {dr.thread_count()} threads"


def _cores() -> str:
    """Others may need some, which is no failure; fits then take fewer threads."""
    free = cores.free_cores()
    return f"{cores.cores():g}" if free is None else f"{free:.1f} of {cores.cores():g} free"


def _torch() -> str:
    torch = import_module("torch")
    return f"{torch.__version__}, {torch.get_num_threads()} threads"


def _bfloat16() -> str:
    flags = " ".join(precision.bfloat16_flags())
    if precision.bfloat16_is_fast():
        return f"in use ({flags or 'on request'})"
    reason = f"off by {precision.VARIABLE}" if flags else "this CPU has no fast bfloat16"
    return f"{reason}: float32, a few times slower"


def _cuda() -> str:
    """Nothing needs CUDA, so no finding here is a failure."""
    try:
        torch = import_module("torch")
        return torch.cuda.get_device_name() if torch.cuda.is_available() else "none; not needed"
    except Exception as e:
        return f"not usable ({type(e).__name__}); not needed"


def _weights() -> str:
    weights = import_module("mitex.features.weights")
    path = weights.vgg16_path()
    weights.verify(path, weights.VGG16_SHA256)
    return f"{path.name}, hash verified"


def _ffmpeg() -> str:
    program = import_module("imageio_ffmpeg").get_ffmpeg_exe()
    command = [program, "-version"]
    process = subprocess.run(command, capture_output=True, text=True, timeout=30, check=True)
    return process.stdout.split("Copyright")[0].replace("ffmpeg version", "").strip()
