"""What numba makes of a kernel: an entry, which Python calls, and a part, which other kernels have
in them.

numba by itself makes the same of both: it optimizes a kernel and makes machine code of it, and does
so again with all of it in each kernel that calls it, and in each that calls those. A part is left
as it was translated, and is optimized within its entries alone.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numba
from numba.core import types
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler
from numba.core.compiler_lock import global_compiler_lock
from numba.core.dispatcher import Dispatcher
from numba.core.registry import CPUDispatcher
from numba.core.sigutils import normalize_signature

from .compilation import tell_of_compilation
from .kernel_cache import kernel_cache


def entry(function: Callable, inline: bool, allocates: bool, stamp: str) -> Any:
    """What Python calls; the function itself if numba's compiler is switched off."""
    # Without fastmath, which would save a sixth: fused multiply-adds fall differently in the
    # process that compiles a kernel and in those that load it, and so would a result's last bits.
    dispatcher = numba.njit(error_model="numpy", forceinline=inline, _nrt=allocates)(function)
    if isinstance(dispatcher, Dispatcher):
        dispatcher._cache = kernel_cache(function, stamp)
    return dispatcher


tell_of_compilation()


class Part(CPUDispatcher):
    """A kernel within others."""

    def __init__(self, entry: Dispatcher) -> None:
        super().__init__(
            entry.py_func, targetoptions=entry.targetoptions, pipeline_class=_PartCompiler
        )

    def get_call_template(self, args: Any, kws: Any) -> Any:
        # Once for all numbers that are written at a call, which LLVM sees where it matters.
        return super().get_call_template(
            tuple(map(types.unliteral, args)), {k: types.unliteral(t) for k, t in kws.items()}
        )

    def compile(self, sig: Any) -> Any:
        args, return_type = normalize_signature(sig)
        if args not in self.overloads:
            with global_compiler_lock, self._compiling_counter:
                compiled = self._compiler.compile(args, return_type)
            key = object()  # by which lowering finds it
            self.targetctx.insert_user_function(key, compiled.fndesc, [compiled.library])
            self.overloads[args] = compiled._replace(entry_point=key)
        return self.overloads[args].entry_point


class _PartCompiler(Compiler):
    def __init__(
        self, typingctx: Any, targetctx: Any, library: Any, args: Any, return_type: Any, flags: Any,
        locals: Any,
    ) -> None:  # fmt: skip
        flags.no_compile = flags.no_cpython_wrapper = flags.no_cfunc_wrapper = True
        super().__init__(typingctx, targetctx, library, args, return_type, flags, locals)

    def compile_extra(self, function: Callable) -> Any:
        self.state.library = _PartLibrary(self.state.targetctx.codegen(), function.__qualname__)
        return super().compile_extra(function)


class _PartLibrary(JITCodeLibrary):
    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._finalized = True
