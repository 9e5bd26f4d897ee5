"""Fixtures for all tests."""

import gc
import os
import signal
import sys
import threading
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mitex import atlas, flat_charts
from mitex.cache import content_key
from mitex.charts import Packing, Part, packed_charts
from mitex.runtime import workers
from tests.browser import Browser
from tests.firefox import Firefox

# As the commands do that go to and fro between torch and Dr.Jit; see `mitex.runtime.let_idle_threads_sleep`.
os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--variant", help="Mitsuba's variant in tests that set none (default: llvm_ad_rgb)")


def pytest_configure(config: pytest.Config) -> None:
    # A job in the background starts without Ctrl-C, and hands that on to the processes of the tests.
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGINT, signal.default_int_handler)
    if variant := config.getoption("--variant"):
        from mitex.runtime import init

        init(variant)


@pytest.fixture(autouse=True, scope="module")
def _leave_no_scene() -> Iterator[None]:
    """Frees the scenes that the tests of a module shared."""
    shapes = _shape_count()
    yield
    if _shape_count() > shapes:
        gc.collect()


@pytest.fixture(autouse=True)
def _leave_no_trace() -> Iterator[None]:
    """Gives back the variant, thread counts and Dr.Jit memory, so that no test leaks into another."""
    before, shapes = _process_state(), _shape_count()
    gc.freeze()  # the collector need not look at all that there was before the test
    yield
    if _shape_count() > shapes:
        gc.collect()
    gc.unfreeze()
    after = _process_state()
    for key, value in before.items():
        if after[key] != value:
            SETTERS[key](value)
    if "drjit" in sys.modules:
        sys.modules["drjit"].flush_malloc_cache()


def _process_state() -> dict[str, Any]:
    state: dict[str, Any] = {"allowed": workers._threads}
    if torch := sys.modules.get("torch"):
        state["torch"] = torch.get_num_threads()
    if dr := sys.modules.get("drjit"):
        state["drjit"] = dr.thread_count()
    if (mi := sys.modules.get("mitsuba")) and mi.variant():
        state["variant"] = mi.variant()
    return state


def _shape_count() -> int:
    """How many shapes of Mitsuba there are. Kernels are made for the materials of all of them, so scenes that
    wait for the collector, as many do after an error, make those of later tests ever larger."""
    mi = sys.modules.get("mitsuba")
    if mi is None or not (mi.variant() or "").startswith(("llvm", "cuda")):
        return 0
    shapes: list[Any] = []

    def visit(shape: Any, nothing: Any) -> Any:
        shapes.extend([shape] if shape is not None else [])
        return nothing

    dr = sys.modules["drjit"]
    dr.dispatch(dr.zeros(mi.ShapePtr), visit, mi.Float(0))
    return len(shapes)


def _set_allowed(count: int | None) -> None:
    workers._threads = count


def _set_torch(count: int) -> None:
    sys.modules["torch"].set_num_threads(count)


def _set_drjit(count: int) -> None:
    from mitex.runtime import set_workers

    set_workers(count)


def _set_variant(variant: str) -> None:
    sys.modules["mitsuba"].set_variant(variant)


SETTERS = {"allowed": _set_allowed, "torch": _set_torch, "drjit": _set_drjit, "variant": _set_variant}


@pytest.fixture(autouse=True, scope="session")
def _known_charts() -> Iterator[None]:
    """Many tests unwrap the same few meshes, which takes a process of its own and up to a second each."""
    known: dict[str, list[np.ndarray]] = {}

    def charts(parts: Sequence[Part], packing: Packing, name: str) -> list[np.ndarray]:
        key = content_key(packing, *(array for part in parts for array in part))
        if key not in known:
            known[key] = packed_charts(parts, packing, name)
        return [corners.copy() for corners in known[key]]

    with pytest.MonkeyPatch.context() as patch:
        for module in (atlas, flat_charts):
            patch.setattr(module, "packed_charts", charts)
        yield


@pytest.fixture(scope="module")
def own_cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """An empty cache folder for the tests of a module, in place of the user's."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.mktemp("cache")))
        yield


@pytest.fixture(scope="module")
def quick_settling() -> Iterator[None]:
    """How long a pattern takes to be in order is looked for in 10 steps at most, not 1000, and few pixels."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("mitex.methods.nca.settling.STEPS", (2, 5, 10))
        patch.setattr("mitex.methods.nca.settling.SIDE", 32)
        yield


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    """One browser for all tests."""
    browser = Browser()
    yield browser
    browser.close()


@pytest.fixture(scope="session")
def firefox() -> Iterator[Firefox]:
    """One Firefox for all tests."""
    firefox = Firefox()
    yield firefox
    firefox.close()


@pytest.fixture
def mi() -> Any:
    """Mitsuba with the plugins of Mitex."""
    from mitex.plugins import init

    return init()


@pytest.fixture
def rng() -> np.random.Generator:
    """A seeded NumPy generator."""
    return np.random.default_rng(2024)


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Exemplars and meshes beside the checkout; the test is skipped without them."""
    folder = Path(__file__).parents[2] / "shared" / "data"
    if not folder.is_dir():
        pytest.skip("no shared/data beside the checkout")
    return folder
