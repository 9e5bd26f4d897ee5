"""Arrays of NumPy and tensors of torch as Dr.Jit's: right values, and nothing read that is not there."""

import ast
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import torch

from mitex.runtime import init

init()

from mitex.runtime.jit import mi  # noqa: E402
from mitex.runtime.upload import PACKET, tensor_with_room, upload, with_room  # noqa: E402

FLAT = ("Float", "UInt", "Int", "Bool", "Tensor")  # how types of Dr.Jit begin that hold one flat array
NUMPY = ("np.", ".numpy()", ".astype(")

# Arrays whose last byte is the last one of a page, before a page that must not be read. Each case is told
# before it is tried, since the process would not survive it.
GUARDED = """
import ctypes, mmap
import numpy as np
import torch
import mitex
mitex.init()
from mitex.bridge import call
from mitex.runtime.jit import dr, mi
from mitex.runtime.upload import upload

libc = ctypes.CDLL(None)
for kind, count, library in (
    ("Float", 1001, "numpy"), ("Float64", 1001, "numpy"), ("TensorXf", 3, "numpy"), ("TensorXf", 3, "torch")
):
    print(kind, count, library, flush=True)
    dtype = np.float64 if kind == "Float64" else np.float32
    size = count * np.dtype(dtype).itemsize
    pages = -(-size // mmap.PAGESIZE)
    memory = mmap.mmap(-1, (pages + 1) * mmap.PAGESIZE)
    start = ctypes.addressof(ctypes.c_char.from_buffer(memory))
    end = start + pages * mmap.PAGESIZE
    assert libc.mprotect(ctypes.c_void_p(end), mmap.PAGESIZE, 0) == 0
    array = np.frombuffer((ctypes.c_char * size).from_address(end - size), dtype)
    array[:] = np.arange(count)
    if library == "torch":
        values = call(lambda tensor: tensor + 1, torch.from_numpy(array))
    else:
        values = upload(getattr(mi, kind), array) + 1
        dr.eval(values)
    assert (np.array(values) == np.arange(count) + 1).all()
print("all")
"""


def test_nothing_is_read_past_the_last_page():
    process = subprocess.run([sys.executable, "-c", GUARDED], capture_output=True, text=True)
    cases = process.stdout.splitlines()
    assert process.returncode == 0 and cases[-1] == "all" and len(cases) == 5, cases[-1:] + [process.stderr]


@pytest.mark.parametrize("shape", [(0,), (1,), (15,), (16,), (17,), (5, 7), (3, 1, 2)])
def test_values_and_shapes(shape):
    array = np.random.default_rng(0).random(shape).astype(np.float32)
    for values in (array, np.asfortranarray(array), array[::-1]):
        tensor = np.array(upload(mi.TensorXf, values))
        assert tensor.shape == shape and (tensor == values).all()
    whole = np.arange(np.prod(shape), dtype=np.uint32)
    assert (np.array(upload(mi.UInt32, whole)) == whole).all()


def test_arrays_are_copied_only_where_they_do_not_begin_a_packet_or_a_packet_may_leave_the_page():
    page = np.zeros(8192, np.uint8)
    first = -page.__array_interface__["data"][0] % 4096
    inside = page[first : first + 40].view(np.float32)
    assert np.shares_memory(with_room(inside), inside)
    last = page[first + 4096 - 40 : first + 4096].view(np.float32)
    roomy = with_room(last)
    assert not np.shares_memory(roomy, last) and (roomy == last).all()
    assert roomy.base is not None
    end = roomy.ctypes.data + roomy.nbytes + PACKET * roomy.itemsize
    assert end <= roomy.base.ctypes.data + roomy.base.nbytes
    whole = page[first + 4096 - 64 : first + 4096].view(np.float32)  # Embree reads one past it
    assert not np.shares_memory(with_room(whole), whole)
    whole = page[first + 4096 - 128 : first + 4096 - 64].view(np.float32)
    assert np.shares_memory(with_room(whole), whole)


def test_tensors_are_copied_only_where_a_packet_may_leave_the_page_and_keep_their_gradient():
    page = torch.zeros(8192, dtype=torch.uint8)
    first = -page.data_ptr() % 4096
    inside = page[first : first + 40].view(torch.float32)
    assert tensor_with_room(inside).data_ptr() == inside.data_ptr()
    last = page[first + 4096 - 40 : first + 4096].view(torch.float32).view(5, 2).requires_grad_()
    roomy = tensor_with_room(last)
    assert roomy.data_ptr() != last.data_ptr() and roomy.shape == last.shape
    assert roomy.untyped_storage().nbytes() == 4 * (10 + PACKET)
    weights = torch.arange(10.0).view(5, 2)
    (weights * roomy).sum().backward()
    assert last.grad is not None and (last.grad == weights).all()


def test_no_array_of_numpy_enters_without_room():
    """Dr.Jit's own constructors are for its own arrays, and for Python's numbers."""
    root = Path(__file__).parents[2]
    files = [file for folder in ("mitex", "scenes") for file in (root / folder).rglob("*.py")]
    assert len(files) > 300
    bare = [
        f"{file.relative_to(root)}:{call.lineno}"
        for file in files
        for call in ast.walk(ast.parse(file.read_text(encoding="utf-8")))
        if isinstance(call, ast.Call) and _is_flat(call.func) and any(_of_numpy(a) for a in call.args)
    ]
    assert not bare, f"pass these through mitex.runtime.upload: {', '.join(bare)}"


def _is_flat(function: ast.expr) -> bool:
    """Whether it is a type such as `mi.Float` or `mi.TensorXf`, which shares the memory that it is given."""
    return ast.unparse(function).startswith(tuple(f"mi.{kind}" for kind in FLAT))


def _of_numpy(argument: ast.expr) -> bool:
    text = ast.unparse(argument)
    return not text.startswith("tensor_with_room") and any(sign in text for sign in NUMPY)


@pytest.mark.parametrize("kind", ["Float", "Float64", "UInt32", "UInt8"])
def test_arrays_share_their_kernels_wherever_they_begin(kind):
    from mitex.runtime.jit import dr

    dtype = {"Float": np.float32, "Float64": np.float64, "UInt32": np.uint32, "UInt8": np.uint8}[kind]
    memory, kernels = np.ones(200, dtype), set()
    for first in range(0, 2 * PACKET, 3):
        with dr.scoped_set_flag(dr.JitFlag.KernelHistory):
            dr.kernel_history_clear()
            dr.eval(upload(getattr(mi, kind), memory[first : first + 40]) + 1)
            kernels |= {entry["hash"] for entry in dr.kernel_history() if "hash" in entry}
    assert len(kernels) == 1
