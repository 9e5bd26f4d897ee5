"""Starting Mitsuba: variants, plugins, and a Mitsuba that was imported before Mitex."""

import os
import subprocess
import sys
import time
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

import mitex.plugins
import mitex.runtime
from mitex.errors import ConfigError
from mitex.runtime import llvm
from mitex.runtime.cores import cores
from mitex.runtime.upload import upload


def run(code: str, **environment: str) -> subprocess.CompletedProcess[str]:
    """A Python process of its own, since one process can load only one LLVM."""
    return subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        timeout=120,
    )


def test_init_is_idempotent_and_sets_the_default(mi):
    assert mi.variant() == "llvm_ad_rgb"
    assert mitex.runtime.init() is mi and mitex.init is mitex.runtime.init


def test_a_variant_that_is_set_already_stays(mi):
    mi.set_variant("scalar_rgb")
    assert mitex.runtime.init("llvm_ad_rgb").variant() == "scalar_rgb"


PLUGIN = """
import mitsuba as mi

def register():
    class Grey(mi.Texture):
        def __init__(self, props):
            super().__init__(props)
            self.built_for = mi.variant()

        def to_string(self):
            return f"Grey[{self.built_for}]"

    mi.register_texture("mitex_test_grey", Grey)
"""


def test_plugins_are_registered_again_for_every_variant(mi, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    (tmp_path / "mitex_test_grey.py").write_text(PLUGIN)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(mitex.plugins, "PLUGINS", (import_module("mitex_test_grey"),))
    for variant in ("scalar_rgb", "llvm_ad_spectral", "llvm_ad_rgb", "scalar_rgb"):
        mi.set_variant(variant)
        assert f"Grey[{variant}]" in str(mi.load_dict({"type": "mitex_test_grey"}))


def test_the_real_plugins_follow_the_variant(mi):
    for variant in ("llvm_ad_mono", "llvm_ad_spectral", "llvm_ad_rgb"):
        mi.set_variant(variant)
        field = {"type": "vertex_field", "data": upload(mi.TensorXf, np.zeros((3, 2)))}
        assert isinstance(mi.load_dict(field), mi.Texture)
        assert isinstance(mi.load_dict({"type": "feature", "field": field}), mi.Integrator)


def test_an_unknown_variant_is_refused_and_threads_are_those_that_the_environment_says():
    code = """
import mitex.runtime as r
try:
    r.init("llvm_ad_rbg")
except Exception as error:
    print(type(error).__name__, error)
r.init()
import drjit as dr
print(dr.thread_count())
"""
    refused, count = run(code, MITEX_THREADS="3").stdout.splitlines()
    assert refused.startswith("ConfigError Mitsuba has no variant 'llvm_ad_rbg'") and "llvm_ad_rgb" in refused
    assert count == "3"


def test_importing_mitex_loads_nothing_heavy():
    code = "import sys, mitex.runtime; print({'torch', 'mitsuba', 'numpy'} & set(sys.modules))"
    assert run(code).stdout.strip() == "set()"


def test_a_mitsuba_that_was_imported_before_is_used():
    path = llvm.find_llvm()[0].path
    code = (
        "import mitsuba as m; m.set_variant('llvm_ad_spectral'); import mitex; print(mitex.init().variant())"
    )
    assert run(code, **{llvm.VARIABLE: path}).stdout.strip() == "llvm_ad_spectral"


def test_a_mitsuba_imported_before_without_llvm_is_refused_by_name():
    code = "import mitsuba, os; del os.environ['DRJIT_LIBLLVM_PATH']; import mitex; mitex.init()"
    done = run(code, **{llvm.VARIABLE: "/nowhere/libLLVM.so"})
    assert (
        "RuntimeUnavailable: Dr.Jit was loaded without a usable LLVM; call `mitex.init()` before"
        in done.stderr
    )
    assert "(LLVM " in done.stderr


def test_an_unusable_choice_of_the_user_is_an_error_not_an_abort_and_scalar_variants_need_no_llvm():
    code = """
import mitex
try:
    mitex.init()
except Exception as error:
    print(type(error).__name__, error)
print(mitex.init("scalar_rgb").variant())
"""
    done = run(code, **{llvm.VARIABLE: "/nowhere/libLLVM.so"})
    assert done.returncode == 0, done.stderr
    refused, variant = done.stdout.splitlines()
    assert refused.startswith("RuntimeUnavailable the LLVM that DRJIT_LIBLLVM_PATH names")
    assert variant == "scalar_rgb"


def test_a_real_old_library_loaded_before_is_refused_not_run():
    old = Path("/usr/lib/x86_64-linux-gnu/libLLVM-15.so.1")
    if not old.exists():
        pytest.skip("no LLVM 15 on this machine")
    code = "import mitsuba, os; del os.environ['DRJIT_LIBLLVM_PATH']; import mitex; mitex.init()"
    done = run(code, **{llvm.VARIABLE: str(old)})
    assert done.returncode == 1 and "Dr.Jit was loaded with LLVM 15" in done.stderr


def test_importing_the_plugins_sets_no_variant():
    code = "import mitex.plugins, mitsuba as m; print(m.variant()); m.set_variant('llvm_ad_rgb'); print('ok')"
    assert run(code).stdout.split() == ["None", "ok"]


def test_seeds_give_the_same_numbers_again():
    import torch

    def draw() -> tuple[float, ...]:
        generator = mitex.runtime.seed_everything(7)
        own = torch.rand((), generator=generator).item()
        return own, torch.rand(()).item(), float(np.random.rand())

    assert draw() == draw()


@pytest.mark.parametrize("seed", [-1, 2**32])
def test_seeds_out_of_range_are_refused(seed: int):
    with pytest.raises(ConfigError, match="out of range"):
        mitex.runtime.seed_everything(seed)


def test_threads_reach_torch_and_drjit(mi):
    import torch

    from mitex.runtime.jit import dr

    mitex.runtime.threads(1)
    assert torch.get_num_threads() == 1 and dr.thread_count() == 1
    with pytest.raises(ConfigError, match="0 threads"):
        mitex.runtime.threads(0)


def test_threads_chosen_before_the_start_are_kept_and_workers_are_modest():
    """They go after torch, where threads have priorities of their own; the main thread does not."""
    code = """
import os, sys, mitex.runtime as r
from pathlib import Path
r.threads(3)
r.init()
import drjit as dr
print(dr.thread_count())
r.lower_worker_priority()
for task in sorted(Path("/proc/self/task").iterdir()) if sys.platform == "linux" else ():
    name = (task / "comm").read_text().strip()
    if name.startswith("nt") or int(task.name) == os.getpid():
        print(name[:2], os.getpriority(os.PRIO_PROCESS, int(task.name)) - os.nice(0))
"""
    count, *workers = run(code).stdout.splitlines()
    assert count == "3"
    assert sorted(workers) == (["nt 10", "nt 10", "py 0"] if sys.platform == "linux" else [])


def test_workers_rest_before_any_is_ended(mi, monkeypatch: pytest.MonkeyPatch):
    from mitex.runtime.jit import dr

    sleeps = []
    mitex.runtime.set_workers(1)
    monkeypatch.setattr(time, "sleep", lambda seconds: sleeps.append((seconds, dr.thread_count())))
    for count in (3, 3, 4, 2):
        mitex.runtime.set_workers(count)
        assert dr.thread_count() == count
    before = sleeps.pop()
    assert not sleeps and before[0] > 0.02 and before[1] == 4


def test_torch_yields_cores_unless_the_user_says_otherwise(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("OMP_WAIT_POLICY", "ACTIVE")
    mitex.runtime.let_idle_threads_sleep()
    assert os.environ["OMP_WAIT_POLICY"] == "ACTIVE"
    monkeypatch.delenv("OMP_WAIT_POLICY")
    mitex.runtime.let_idle_threads_sleep()
    assert os.environ["OMP_WAIT_POLICY"] == "PASSIVE"


@pytest.mark.skipif(not Path("/proc/self/task").is_dir(), reason="threads cannot be counted")
@pytest.mark.parametrize(
    ("environment", "blas"), [({}, 1), ({"OMP_NUM_THREADS": "2"}, 2), ({"OPENBLAS_NUM_THREADS": "2"}, 2)]
)
def test_commands_multiply_with_one_thread_in_numpy_unless_the_user_says_otherwise(
    environment: dict[str, str], blas: int, monkeypatch: pytest.MonkeyPatch
):
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
        monkeypatch.delenv(name, raising=False)
    code = (
        "import os, sys, mitex.cli\n"
        "assert 'numpy' not in sys.modules\n"
        "mitex.cli.main(['--version'])\n"
        "import numpy as np\n"
        "a = np.ones((300, 300))\n"
        "a @ a\n"
        "print(len(os.listdir('/proc/self/task')))"
    )
    assert run(code, **environment).stdout.split()[-1] == str(min(blas, int(cores())))


def test_fitting_radiance_fields_asks_torch_to_yield_before_it_is_loaded(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.delenv("OMP_WAIT_POLICY", raising=False)
    code = (
        "import os, sys, mitex.methods.nerf.cli as c\n"
        "from pathlib import Path\n"
        "assert 'torch' not in sys.modules\n"
        "sys.modules['torch'] = None  # to load it is an error\n"
        "try:\n    c.Fit(capture=Path('nowhere')).run()\nexcept ImportError:\n"
        "    print(os.environ['OMP_WAIT_POLICY'])"
    )
    assert run(code).stdout.strip() == "PASSIVE"
