"""The compiled model and its frame as a shared library that needs no Python, for this platform and for others."""

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterable
from dataclasses import dataclass
from importlib.util import find_spec
from math import isfinite
from pathlib import Path
from typing import Any

import llvmlite.binding as llvm

from tasks.errors import InputError
from tasks.vehicle.model.embedded import DONE, NO_TYRE, START, measure_block
from tasks.vehicle.model.embedded_variables import INPUTS, OUTPUTS, PLACE
from tasks.vehicle.model.simulation import INTERNAL_STEP_S
from tasks.vehicle.model.states import STATE_WIDTH
from tasks.vehicle.parameters import Vehicle

FRAME = Path(__file__).with_name("fmu_frame") / "frame.c"
ENTRY = "musync_advance"
_OF_PYTHON = re.compile(r"(Py|NRT_|numba_)\w+")
"""Names that compiled code asks for where it raises an error of Python's; the model's own path has none."""


@dataclass(frozen=True, kw_only=True)
class Platform:
    """A platform of the FMI standard.

    Parameters
    ----------
    name : folder of its library in an FMU (FMI 2.0.4, section 2.3)
    triple : for LLVM
    target : for Zig's C compiler
    suffix : of the library
    system : what `sys.platform` says there
    """

    name: str
    triple: str
    target: str
    suffix: str
    system: str


PLATFORMS = {
    row.name: row
    for row in (
        Platform(name="linux64", triple="x86_64-unknown-linux-gnu", target="x86_64-linux-gnu.2.17", suffix=".so",
                 system="linux"),
        Platform(name="win64", triple="x86_64-pc-windows-gnu", target="x86_64-windows-gnu", suffix=".dll",
                 system="win32"),
        Platform(name="darwin64", triple="x86_64-apple-macosx11.0", target="x86_64-macos.11.0", suffix=".dylib",
                 system="darwin"),
    )
}  # fmt: skip
"""Platforms by name, all of them x86-64: the standard has no other with 64 bits."""


def find_own_platform() -> Platform:
    """Return the platform of this system."""
    return next(row for row in PLATFORMS.values() if row.system == sys.platform)


def find_compiler(platform: Platform) -> list[str]:
    """Return the command that compiles C for a platform: the system's for its own, Zig's for others.

    Parameters
    ----------
    platform : where the library will run

    Raises
    ------
    InputError
        If there is none.
    """
    own = shutil.which("cc") if platform.system == sys.platform else None
    if own is not None:
        return [own]
    if find_spec("ziglang") is None:
        raise InputError(
            f"--platform {platform.name}: needs a C compiler, and none is installed: pip install 'musync-gs[fmu]'"
        )
    return [sys.executable, "-m", "ziglang", "cc", "-target", platform.target]


def emit_model(text: str, entry: str, platform: Platform) -> tuple[bytes, list[str]]:
    """Return a compiled function as the object file of a platform, under the name `ENTRY`.

    Parameters
    ----------
    text : LLVM's text of the function and of all that it calls
    entry : its name there
    platform : where it will run

    Returns
    -------
    The object file, and the names that it asks others for.
    """
    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    machine = llvm.Target.from_triple(platform.triple).create_target_machine(
        cpu="x86-64", opt=2, reloc="pic", codemodel="small"
    )
    module = llvm.parse_assembly(text)
    module.triple, module.data_layout = platform.triple, str(machine.target_data)
    for function in module.functions:
        if not function.is_declaration:
            function.linkage = "external" if function.name == entry else "internal"
    for variable in module.global_variables:
        if not variable.is_declaration:
            variable.linkage = "internal"
    model = module.get_function(entry)
    model.name, model.visibility = ENTRY, "hidden"  # two cars in one simulator must not find each other's
    passes = llvm.create_new_module_pass_manager()
    passes.add_global_dead_code_eliminate_pass()
    passes.run(module, llvm.create_pass_builder(machine, llvm.create_pipeline_tuning_options(speed_level=0)))
    asked = [*module.functions, *module.global_variables]
    return machine.emit_object(module), sorted(symbol.name for symbol in asked if symbol.is_declaration)


def build_library(compiled: Any, header: str, platform: Platform, folder: Path) -> bytes:
    """Return the shared library of an FMU.

    Parameters
    ----------
    compiled : of `tasks.vehicle.model.embedded.compile_advance`
    header : of `format_header`
    platform : where it will run
    folder : empty, for what is made on the way

    Raises
    ------
    InputError
        If there is no compiler for the platform.
    RuntimeError
        If the compiler refuses, with what it says.
    """
    compiler = find_compiler(platform)
    content, asked = emit_model(compiled.inspect_llvm(), compiled.native_name, platform)
    (folder / "model.o").write_bytes(content)
    (folder / "model.h").write_text(header)
    stubs = [f"void *{name}(void) {{ return 0; }}\n" for name in asked if _OF_PYTHON.fullmatch(name)]
    (folder / "stubs.c").write_text("".join(stubs))
    library = folder / f"library{platform.suffix}"
    words = [
        "-std=c11",
        "-O2",
        "-s",
        "-shared",
        "-fPIC",
        "-fvisibility=hidden",
        f"-I{folder}",
        "-o",
        str(library),
    ]
    if platform.system == "linux":
        words.append("-Wl,--no-undefined")
    done = subprocess.run(
        [*compiler, *words, str(FRAME), str(folder / "stubs.c"), str(folder / "model.o"), "-lm"],
        capture_output=True, text=True, env=os.environ,
    )  # fmt: skip
    if done.returncode:
        raise RuntimeError(f"the C compiler refuses the frame of the FMU: {done.stderr[-2000:]}")
    return library.read_bytes()


def format_header(vehicle: Vehicle, starts: Iterable[float], guid: str) -> str:
    """Return model.h: what the frame must know of the block.

    Parameters
    ----------
    vehicle : the vehicle
    starts : start value of each input [its unit]
    guid : of the FMU
    """
    numbers = {
        "PARAMETERS": sum(row.role == "parameter" for row in INPUTS), "INPUTS": len(INPUTS),
        "OUTPUTS": len(OUTPUTS), "TIME": len(INPUTS) + len(OUTPUTS), "WEATHER": PLACE["weather"],
        "STATE_WIDTH": STATE_WIDTH, "BLOCK": measure_block(vehicle), "START": START, "DONE": DONE,
        "NO_TYRE": NO_TYRE, "STEP": INTERNAL_STEP_S,
    }  # fmt: skip
    names = ", ".join(f'"{row.name}"' for row in (*INPUTS, *OUTPUTS))
    lines = [f'#define GUID "{guid}"', *(f"#define {name} ({value!r})" for name, value in numbers.items())]
    lines += [
        _format_table("STARTS", starts),
        _format_table("MINIMA", (row.minimum for row in INPUTS)),
        _format_table("MAXIMA", (row.maximum for row in INPUTS)),
        f"static const char *const NAMES[] = {{{names}}};",
    ]
    return "\n".join(lines) + "\n"


def _format_table(name: str, values: Iterable[float]) -> str:
    words = (repr(v) if isfinite(v) else ("-INFINITY" if v < 0 else "INFINITY") for v in values)
    return f"static const double {name}[] = {{{', '.join(words)}}};"
