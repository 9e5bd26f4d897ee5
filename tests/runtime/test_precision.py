"""Which CPUs get bfloat16."""

from pathlib import Path

import pytest
import torch

from mitex.errors import ConfigError
from mitex.runtime import bfloat16_is_fast, mixed_precision, uses_bfloat16
from mitex.runtime.precision import VARIABLE, bfloat16_flags


@pytest.mark.parametrize(
    ("flags", "expected"),
    [
        ("fpu avx512f avx512_bf16 amx_bf16 amx_tile", ("amx_bf16", "avx512_bf16")),
        ("fpu avx512_bf16", ("avx512_bf16",)),
        ("fpu avx2 avx512f", ()),
    ],
)
def test_flags_are_read(tmp_path: Path, flags: str, expected: tuple[str, ...]):
    cpuinfo = tmp_path / "cpuinfo"
    cpuinfo.write_text(f"processor\t: 0\nflags\t\t: {flags}\n\nprocessor\t: 1\nflags\t\t: fpu amx_bf16\n")
    assert bfloat16_flags(str(cpuinfo)) == expected


def test_no_flags_where_the_system_does_not_tell(tmp_path: Path):
    assert bfloat16_flags(str(tmp_path / "absent")) == ()


@pytest.mark.parametrize(("value", "expected"), [("0", False), ("1", True)])
def test_the_variable_decides(monkeypatch: pytest.MonkeyPatch, value: str, expected: bool):
    monkeypatch.setenv(VARIABLE, value)
    assert bfloat16_is_fast() is expected


def test_another_value_is_an_error(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv(VARIABLE, "yes")
    with pytest.raises(ConfigError, match="MITEX_BF16 is 'yes'"):
        bfloat16_is_fast()


@pytest.mark.parametrize("fast", [False, True])
def test_a_network_has_the_precision_that_it_is_given(monkeypatch: pytest.MonkeyPatch, fast: bool):
    monkeypatch.setenv(VARIABLE, str(int(fast)))
    assert [uses_bfloat16(word) for word in ("bfloat16", "float32", "auto")] == [True, False, fast]
    with pytest.raises(ConfigError, match="unknown precision 'bf16'"):
        uses_bfloat16("bf16")


@pytest.mark.parametrize(("fast", "dtype"), [(False, torch.float32), (True, torch.bfloat16)])
def test_products_are_mixed_where_that_is_fast(
    monkeypatch: pytest.MonkeyPatch, fast: bool, dtype: torch.dtype
):
    monkeypatch.setenv(VARIABLE, str(int(fast)))
    weight = torch.randn(4, 3, requires_grad=True)
    with mixed_precision():
        product = torch.nn.functional.linear(torch.randn(2, 3), weight)
    product.float().sum().backward()
    assert product.dtype == dtype and weight.grad is not None and weight.grad.dtype == torch.float32
