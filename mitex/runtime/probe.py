"""Tries one LLVM library with Dr.Jit; run as a script in a process of its own, which may die.

Prints JSON objects, one a line: `{"version": [major, minor, patch]}`, `{"error": "..."}`, `{"usable": true}`.
"""

import ctypes
import json
import os
import sys


def say(**message: object) -> None:
    print(json.dumps(message), flush=True)


def version_of(path: str) -> tuple[int, int, int] | None:
    """The version that a library reports; `LLVMGetVersion` exists since LLVM 16."""
    library = ctypes.CDLL(path)
    if not hasattr(library, "LLVMContextCreate"):
        raise OSError("it is not an LLVM library")
    if not hasattr(library, "LLVMGetVersion"):
        return None
    parts = [ctypes.c_uint() for _ in range(3)]
    library.LLVMGetVersion(*(ctypes.byref(part) for part in parts))
    return parts[0].value, parts[1].value, parts[2].value


def kernel_works() -> bool:
    """Compiles and runs the instruction (fminimum) that LLVM 15 and 16 abort on."""
    import drjit as dr
    from drjit.llvm import Float

    return dr.sum(dr.minimum(dr.arange(Float, 16), 3.5))[0] == 48.0


def main(path: str, oldest: int) -> None:
    try:
        import resource

        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    except (ImportError, OSError, ValueError):
        pass
    try:
        version = version_of(path)
    except OSError as e:
        say(error=f"it cannot be loaded: {e}")
        return
    say(version=version)
    if version is None or version[0] < oldest:
        return
    os.environ["DRJIT_LIBLLVM_PATH"] = path
    try:
        if kernel_works():
            say(usable=True)
        else:
            say(error="it computes wrong values")
    except Exception as e:
        say(error=f"Dr.Jit refuses it: {e}")


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]))
