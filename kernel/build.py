"""The kernel's library by Zig's C compiler, which pip brings: a variant for each kind of processor.

`python kernel/build.py OUT` builds it for this one, `--target` for another, `--check` with gcc's sanitizers.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import platform
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
FLAGS = ["-O3", "-std=gnu11", "-g0", "-fPIC", "-fvisibility=hidden", "-Wall", "-Werror"]
# products and sums are fused within an expression alone, so that all processors that can do so round alike
FLAGS += ["-ffp-contract=on", "-fno-math-errno", "-fno-trapping-math"]
CHECKS = ["-O1", "-g", "-std=gnu11", "-fPIC", "-fno-sanitize-recover"]
CHECKS += ["-fsanitize=address,undefined,float-cast-overflow"]
VARIANTS = {"v2": ("x86_64_v2", 4), "v3": ("x86_64_v3", 16), "v4": ("x86_64_v4", 16)}
"""Processors, and floats of a packet; v3 and v4 give the same bytes."""
TARGETS = {
    "linux": ("x86_64-linux-gnu.2.17", "manylinux_2_17_x86_64"),
    "linux-arm": ("aarch64-linux-gnu.2.17", "manylinux_2_17_aarch64"),
    "mac": ("x86_64-macos.11.0", "macosx_11_0_x86_64"),
    "mac-arm": ("aarch64-macos.11.0", "macosx_11_0_arm64"),
    "windows": ("x86_64-windows-gnu", "win_amd64"),
}
"""Names of other machines: what Zig and what wheels call them."""


def name(target: str | None = None) -> str:
    """The library's file; Windows and macOS load any name, too, and one name is easier to find."""
    return "libkernel.dll" if (target or sys.platform).startswith("win") else "libkernel.so"


def mark() -> str:
    """A digest of the sources, by which a library is known to be theirs."""
    total = hashlib.sha256()
    for path in sorted([*HERE.glob("*.[ch]"), HERE / "build.py"]):
        total.update(path.read_bytes())
    return total.hexdigest()[:16]


def is_built(out: Path) -> bool:
    """True if a file is the library of these sources."""
    return out.is_file() and mark().encode() in out.read_bytes()


def build(out: Path, target: str | None = None, check: bool = False) -> None:
    """Build the library and put it in its place whole; raises RuntimeError with what the compiler said."""
    machine = TARGETS[target][0] if target else platform.machine().lower()
    compiler = ["gcc", *CHECKS] if check else [sys.executable, "-m", "ziglang", "cc", *FLAGS]
    compiler += ["-target", machine] if target else []
    compiler += [f'-DMARK="{mark()}"']
    several = machine.startswith(("x86_64", "amd64")) and not check
    variants = VARIANTS if several else {"v2": (None, 8)}
    out.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=out.parent) as folder:
        objects = [f"{folder}/{variant}.o" for variant in variants]
        jobs = []
        for object, (variant, (cpu, width)) in zip(objects, variants.items(), strict=True):
            job = [*compiler, f"-DW={width}", f"-DNAME(x)=x##_{variant}", "-c", str(HERE / "kernel.c")]
            jobs.append([*job, *([f"-mcpu={cpu}"] if cpu else []), "-o", object])
        last = [*compiler, "-shared", *([] if check else ["-s"]), *([] if several else ["-DONE"])]
        library = f"{folder}/{out.name}"
        last += [str(HERE / "dispatch.c"), *objects, "-o", library]
        last += [] if machine.startswith("x86_64-windows") else ["-lm"]
        running = [subprocess.Popen(job, stderr=subprocess.PIPE, text=True) for job in jobs]
        said = "".join(job.communicate()[1] for job in running)
        if any(job.returncode for job in running):
            raise RuntimeError(f"the kernel does not compile:\n{said}")
        done = subprocess.run(last, capture_output=True, text=True, check=False)
        if done.returncode:
            raise RuntimeError(f"the kernel does not link:\n{done.stderr}")
        os.replace(library, out)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path)
    parser.add_argument("--target", choices=TARGETS)
    parser.add_argument("--check", action="store_true")
    options = parser.parse_args()
    build(options.out, options.target, options.check)
