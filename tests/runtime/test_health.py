"""The data of `mitex doctor`."""

from pathlib import Path

import pytest

from mitex.errors import RuntimeUnavailable
from mitex.runtime import Check, doctor, health, llvm

NAMES = ["LLVM", "Mitsuba", "Dr.Jit", "cores", "torch", "bfloat16", "CUDA", "weights", "ffmpeg"]


def report() -> dict[str, Check]:
    checks = doctor()
    assert [check.name for check in checks] == NAMES
    for check in checks:
        assert check.detail and "\n" not in check.detail
        assert bool(check.fix) == (not check.ok), check
    return {check.name: check for check in checks}


def test_everything_is_well_here():
    assert [check for check in report().values() if not check.ok] == []


def test_a_missing_llvm_is_told_once_with_its_remedy(monkeypatch: pytest.MonkeyPatch):
    def find_llvm():
        raise RuntimeUnavailable("found none", "install one")

    def init():
        return find_llvm()

    monkeypatch.setattr(llvm, "find_llvm", find_llvm)
    monkeypatch.setattr(health.session, "init", init)
    checks = report()
    assert checks["LLVM"] == Check("LLVM", False, "found none", "install one")
    assert checks["Dr.Jit"] == Check("Dr.Jit", False, "cannot start", "mend LLVM and Mitsuba first")


def test_damaged_weights_are_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    damaged = tmp_path / "vgg16.safetensors"
    damaged.write_bytes(b"x" * 100)
    monkeypatch.setenv("MITEX_VGG16", str(damaged))
    assert not report()["weights"].ok


def test_a_wrong_setting_and_a_broken_ffmpeg_are_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("MITEX_BF16", "maybe")
    monkeypatch.setenv("IMAGEIO_FFMPEG_EXE", str(tmp_path / "absent"))
    checks = report()
    assert not checks["bfloat16"].ok and not checks["ffmpeg"].ok


def test_no_cuda_is_never_a_failure(monkeypatch: pytest.MonkeyPatch):
    import torch

    def broken() -> bool:
        raise RuntimeError("driver mismatch")

    monkeypatch.setattr(torch.cuda, "is_available", broken)
    check = report()["CUDA"]
    assert check.ok and "not usable" in check.detail
