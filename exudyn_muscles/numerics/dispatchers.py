"""What numba makes of a kernel: an entry, which Python calls, and a part, which other kernels have
in them.

numba by itself makes the same of both: it optimizes a kernel and makes machine code of it, and does
so again with all of it in each kernel that calls it, and in each that calls those. A part is left
as it was translated, and is optimized within its entries alone.
"""

from __future__ import annotations

import gc
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from llvmlite.binding import Linkage, parse_assembly
from numba.core import config, types
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler
from numba.core.compiler_lock import global_compiler_lock
from numba.core.imputils import user_function
from numba.core.registry import CPUDispatcher
from numba.core.sigutils import normalize_signature

from .compilation import tell_of_compilation
from .kernel_cache import kernel_cache


def entry(function: Callable, inline: bool, allocates: bool, stamp: str) -> Callable:
    """What Python calls; the function itself if numba's compiler is switched off."""
    if config.DISABLE_JIT:
        return function
    # Without fastmath, which would save a sixth: fused multiply-adds fall differently in the
    # process that compiles a kernel and in those that load it, and so would a result's last bits.
    options = {"error_model": "numpy", "forceinline": inline, "_nrt": allocates}
    made = Entry(
        function, targetoptions={"nopython": True, **options}, pipeline_class=_EntryCompiler
    )
    made._cache = kernel_cache(function, stamp)
    return made


class Entry(CPUDispatcher):
    """A kernel as Python calls it."""

    def compile(self, sig: Any) -> Any:
        with _uncollected():
            return super().compile(sig)


class Part(CPUDispatcher):
    """A kernel within others."""

    def __init__(self, entry: Entry) -> None:
        super().__init__(
            entry.py_func, targetoptions=entry.targetoptions, pipeline_class=_PartCompiler
        )

    def get_call_template(self, args: Any, kws: Any) -> Any:
        # One part for all numbers that are written at a call: LLVM sees them where it matters.
        literal = {name: types.unliteral(each) for name, each in kws.items()}
        return super().get_call_template(tuple(map(types.unliteral, args)), literal)

    def compile(self, sig: Any) -> Any:
        """A key, by which the translation of a call finds the part."""
        args, _ = normalize_signature(sig)
        if args not in self.overloads:
            plain = tuple(map(_writable, args))
            if args == plain:
                with global_compiler_lock, self._compiling_counter:
                    made = self._compiler.compile(args, None)
                made = made._replace(entry_point=object())
            else:
                self.compile(plain)
                made = self.overloads[plain]
                made = made._replace(signature=made.signature.replace(args=args))
            call = user_function(made.fndesc, [made.library])
            self.targetctx.insert_func_defn([(call, made.entry_point, args)])
            self.overloads[args] = made
        return self.overloads[args].entry_point


def _writable(argument: types.Type) -> types.Type:
    """The type that arrays would have if all could be written: the code is the same."""
    if isinstance(argument, types.Array):
        return argument.copy(readonly=False)
    if isinstance(argument, types.NamedTuple):
        return types.NamedTuple(map(_writable, argument), argument.instance_class)
    return argument


class _EntryCompiler(Compiler):
    def __init__(self, typingctx: Any, targetctx: Any, *rest: Any) -> None:
        super().__init__(typingctx, targetctx, *rest)
        self.state.flags.no_cfunc_wrapper = True  # for C, which calls none

    def compile_extra(self, function: Callable) -> Any:
        self.state.library = _EntryLibrary(self.state.targetctx.codegen(), function.__qualname__)
        self.state.library.enable_object_caching()
        return super().compile_extra(function)


class _EntryLibrary(JITCodeLibrary):
    def _get_module_for_linking(self) -> Any:
        """What is stored beside the machine code: the names in it, as no other kernel has an entry
        within it. Its code would take longer to load than the machine code."""
        names = [f.name for f in self.get_defined_functions() if f.linkage == Linkage.external]
        return parse_assembly(
            "\n".join(f'define void @"{each}"() {{ ret void }}' for each in names)
        )


class _PartCompiler(Compiler):
    def __init__(self, typingctx: Any, targetctx: Any, *rest: Any) -> None:
        super().__init__(typingctx, targetctx, *rest)
        flags = self.state.flags
        flags.no_compile = flags.no_cpython_wrapper = flags.no_cfunc_wrapper = True

    def compile_extra(self, function: Callable) -> Any:
        self.state.library = _PartLibrary(self.state.targetctx.codegen(), function.__qualname__)
        return super().compile_extra(function)


class _PartLibrary(JITCodeLibrary):
    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._finalized = True


@contextmanager
def _uncollected() -> Iterator[None]:
    """Without garbage collection, which took a tenth of compiling and found nothing."""
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if enabled:
            gc.enable()


tell_of_compilation()
