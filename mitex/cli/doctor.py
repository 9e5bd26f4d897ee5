"""`mitex doctor`."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass
class Doctor:
    """Check that everything Mitex needs works here; one line for each thing, with the fix where it does not.

    The exit code is 0 if all is well, else 1.

    examples:
      mitex doctor
      DRJIT_LIBLLVM_PATH=/usr/lib/libLLVM.so.19 mitex doctor
    """

    def run(self) -> int:
        from mitex.runtime import doctor

        checks = doctor()
        width = max(len(check.name) for check in checks)
        for check in checks:
            line = f"{'OK  ' if check.ok else 'FAIL'}  {check.name:{width}}  {check.detail}"
            print(line if check.ok else f"{line}; {check.fix}")
        return 0 if all(check.ok for check in checks) else 1
