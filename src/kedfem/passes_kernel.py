"""Faster compilation of parts of loops by numba: only the compiler passes that they need, and no repeated type queries.

Numba's own pipeline looks for closures, generators, array expressions and `with` blocks, which parts do not have, and
after each of its passes it computes again where each variable is used. Of parts no references are counted, so that
nothing is to be done where a variable is used for the last time.
"""
# mypy: disable-error-code="attr-defined, no-untyped-call, misc"
# numba's own classes have no types

from typing import Any

from numba.core import rewrites, types
from numba.core.analysis import dead_branch_prune, rewrite_semantic_constants
from numba.core.base import BaseContext
from numba.core.compiler import CompilerBase
from numba.core.compiler_machinery import PassManager
from numba.core.ir_utils import build_definitions
from numba.core.postproc import PostProcessor
from numba.core.ssa import reconstruct_ssa
from numba.core.typed_passes import NativeLowering, NoPythonBackend, NopythonTypeInference, PreLowerStripPhis
from numba.core.types.functions import BaseFunction
from numba.core.untyped_passes import FixupArgs, TranslateByteCode

from kedfem.indexing_kernel import compact


class _Passes(PassManager):
    """Those of numba's passes that change what is compiled of a part."""

    def run(self, state: Any) -> None:
        """From bytecode to machine-independent code."""
        TranslateByteCode().run_pass(state)
        FixupArgs().run_pass(state)
        PostProcessor(state.func_ir).run()
        rewrite_semantic_constants(state.func_ir, state.args)
        dead_branch_prune(state.func_ir, state.args)
        rewrites.rewrite_registry.apply("before-inference", state)
        state.func_ir = reconstruct_ssa(state.func_ir)
        state.func_ir._definitions = build_definitions(state.func_ir.blocks)
        NopythonTypeInference().run_pass(state)
        PreLowerStripPhis().run_pass(state)
        state.type_annotation = ""  # for readers of numba's own pages
        NativeLowering().run_pass(state)
        NoPythonBackend().run_pass(state)


class Quick(CompilerBase):
    """The pipeline of these passes, in the form in which numba takes one."""

    def define_pipelines(self) -> list[Any]:
        """It alone."""
        return [_Passes("parts")]


def ask_once() -> None:
    """Let numba keep what operators make of types, and how large types are, while it compiles kedfem's code."""
    functions: Any = BaseFunction
    context: Any = BaseContext
    resolve, size, constant = functions.get_call_type, context.get_abi_sizeof, context.get_constant_generic
    found: dict[Any, Any] = {}
    sizes: dict[str, int] = {}

    def resolved(self: Any, context: Any, args: Any, named: Any) -> Any:
        if named or not compact.get():
            return resolve(self, context, args, named)
        key = id(context), id(self), *map(id, args)
        kept = found.get(key)
        if kept is None:
            signature: Any = resolve(self, context, args, named)
            if self._impl_keys[signature.args] is not self.typing_key:
                return signature  # compiled for its caller's options
            found[key] = kept = signature, self, context, args  # which stay, so that no other gets their numbers
        return kept[0]

    def sized(self: Any, kind: Any) -> int:
        name = str(kind)
        if name not in sizes:
            sizes[name] = size(self, kind)
        return sizes[name]

    def constant_of(self: Any, builder: Any, kind: Any, value: Any) -> Any:
        if compact.get() and isinstance(kind, types.Dispatcher):  # a name by which a function is called, and nothing else
            return self.get_constant_null(kind)
        return constant(self, builder, kind, value)

    functions.get_call_type, context.get_abi_sizeof, context.get_constant_generic = resolved, sized, constant_of
