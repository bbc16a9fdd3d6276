"""The cache of loops compiled by numba, with one folder for each state of kedfem's compiled code.

numba compiles a function again when its own file has changed, but not when one that it calls in another file has, nor a
constant there. So what it compiled is kept in a folder named after all `*kernel.py` files together, what they import of
kedfem, the records that they are given, and this file with its options: in the user's cache folder, so that a read-only
installation compiles once too, or beside the package where that cannot be used. Numba takes a while to load: imported by
kernels, and where it is reported that it compiles.
"""

# mypy: disable-error-code="misc, no-untyped-call"
# numba's own classes have no types

import atexit
import os
import re
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Any

import numba
from llvmlite.binding import get_host_cpu_name
from numba.core import codegen, event, types
from numba.core.runtime.nrt import rtsys

from kedfem.folders import KERNELS, compiled_folder, drop_changed, note, noted
from kedfem.indexing_kernel import compact

ROOT = Path(__file__).parent
KNOWN = numba.version_info.short <= (0, 68)
"""Whether numba's insides are those that compiling in less time was written for; later ones compile as they are."""
RECORDS = ("dynamics/system/arrays.py", "dynamics/system/state.py", "dynamics/metric.py", "motion/blocks.py")
"""Where the named tuples stand that kernels are given: numba's cache names them by their modules."""

PATIENCE = 120.0  # s, with a process that compiles a function; one that was stopped would be waited for for ever


def kernel_folder(root: Path) -> Path:
    """The folder of what was compiled of all kernels under a folder."""
    digest = sha256()
    kernels = set(root.rglob("*kernel.py"))
    records = {file for name in RECORDS if (file := root / name).is_file()}
    for file in sorted(kernels | records | {each for kernel in kernels for each in _imported(kernel, root)}):
        digest.update(file.read_bytes())
    return (compiled_folder() or root / "__pycache__" / KERNELS) / digest.hexdigest()[:16]


def _imported(kernel: Path, root: Path) -> set[Path]:
    """The files of the package that a kernel takes functions, constants and options from."""
    names = re.findall(rf"^\s*(?:from|import) {root.name}\.([\w.]+)", kernel.read_text(), re.MULTILINE)
    files = (root / Path(*name.split(".")) for name in names)
    found = (file for path in files for file in (path.with_suffix(".py"), path / "__init__.py"))
    return {file for file in found if file.is_file()}


def all_compiled() -> Path:
    """A file that stands in numba's folder once all of these kernels have been compiled for this processor.

    Numba keeps code for one installation, and while its files' times stay: of another, or after an upgrade that left the
    kernels alone, nothing that it kept is used.
    """
    stamps = [f"{(_FOLDER or kernel_folder(ROOT)).name} {numba.__version__} {sys.version}"]
    for kernel in sorted(ROOT.rglob("*kernel.py")):
        stat = kernel.stat()
        stamps.append(f"{kernel} {stat.st_mtime_ns} {stat.st_size}")
    options = vars(numba.config)
    processor = options["CPU_NAME"] or get_host_cpu_name()
    digest = sha256("\n".join(stamps).encode()).hexdigest()[:16]
    return Path(options["CACHE_DIR"], f"all-{digest}-{processor}")


def compiles_for_all() -> bool:
    """Whether loops are those that all scenes may take: where these are kept. Else each kind of scene has its own."""
    return _for_all.get() or _kept_for_all()


@cache
def _kept_for_all() -> bool:
    return all_compiled().exists()


@contextmanager
def for_all_scenes() -> Iterator[None]:
    """Have loops compiled that all scenes may take."""
    outside = _for_all.set(True)
    try:
        yield
    finally:
        _for_all.reset(outside)


_for_all: ContextVar[bool] = ContextVar("for all", default=False)


@contextmanager
def compiling(report: Callable[[bool], None]) -> Iterator[None]:
    """Report when numba begins to compile, by True, and when it ends, by False; loading compiled code is not reported."""
    with event.install_listener("numba:compile", _Compiling(report)):
        yield


class _Compiling(event.Listener):
    """Called once for each function; those that a function calls are compiled within it."""

    def __init__(self, report: Callable[[bool], None]) -> None:
        self.report, self.depth = report, 0

    def on_start(self, _: object) -> None:
        self.depth += 1
        if self.depth == 1:
            self.report(True)

    def on_end(self, _: object) -> None:
        self.depth -= 1
        if self.depth == 0:
            self.report(False)


_FOLDER = None if os.environ.get("NUMBA_CACHE_DIR") else kernel_folder(ROOT)
_NOTED = noted(_FOLDER) if _FOLDER else {}
if _FOLDER:
    atexit.register(note, _FOLDER)
    vars(numba.config)["CACHE_DIR"] = str(_FOLDER)


def _kept(options: dict[str, Any]) -> Callable[[Callable[..., Any]], Any]:
    """What compiles a function by numba, and keeps it while no other process does.

    Numba writes the list of what is kept of a function, then the code: of two processes that compile it for different
    types at once, one could find the other's code under its own types. Of two that compile it for the same types, one
    waits for the other.
    """

    def compiles(function: Callable[..., Any]) -> Any:
        dispatcher = numba.njit(**options)(function)
        cache = dispatcher._cache
        file = cache._cache_file
        save, lock = file.save, Path(dispatcher.stats.cache_path, "lock")

        def alone(key: object, code: object) -> None:
            from filelock import FileLock

            with FileLock(lock):
                save(key, code)

        def read(given: object, context: Any) -> Any:
            if _NOTED:
                drop_changed(Path(cache.cache_path), _NOTED, cache._impl.filename_base)
            rtsys.initialize(context)  # all that code needs of numba, which would prepare to compile as well
            outside = _part.set(part)
            try:
                return cache._load_overload(given, context)
            finally:
                _part.reset(outside)

        def loaded(given: object, context: Any) -> Any:
            found = read(given, context)
            if found is None and dispatcher._can_compile:
                claims.append(_claimed(lock.with_name(f"{cache._impl.filename_base}.lock"), dispatcher))
                found = read(given, context)
            return found

        file.save, cache.load_overload = alone, loaded
        begin, part, claims = dispatcher.compile, "no_cpython_wrapper" in options, list[Any]()

        def reported(given: object) -> Any:
            outside, indices = _part.set(part), compact.set(KNOWN)
            try:
                return begin(given)
            finally:
                _part.reset(outside)
                compact.reset(indices)
                while claims:
                    claims.pop().release()

        dispatcher.compile, called = reported, dispatcher.get_call_template

        def for_any_value(given: Any, named: dict[str, Any]) -> Any:
            # else it is compiled for each constant that it is called with
            plain = {name: types.unliteral(kind) for name, kind in named.items()}
            return called(tuple(types.unliteral(kind) for kind in given), plain)

        dispatcher.get_call_template = for_any_value
        return dispatcher

    return compiles


def _claimed(file: Path, dispatcher: Any) -> Any:
    """A lock of what this process compiles; another that is at it is waited for, which is reported as compiling."""
    from filelock import FileLock, Timeout

    lock = FileLock(file)
    with suppress(OSError):  # where nothing can be kept each process compiles
        try:
            lock.acquire(timeout=0)
        except Timeout:
            with event.trigger_event("numba:compile", data={"dispatcher": dispatcher}), suppress(Timeout):
                lock.acquire(timeout=PATIENCE)
    return lock


_part: ContextVar[bool] = ContextVar("part", default=False)
"""Whether what this thread compiles is only ever a part of other functions; another may wait to compile a whole."""


class _Part(codegen.JITCodeLibrary):
    """Code that is only ever a part of loops: they are optimised with all that they call, and it is not before that.

    The loops are as fast, and compiled in less time. Nor is it made machine code of.
    """

    def finalize(self) -> None:
        """Put what it calls beside it, unchecked: the loops are, with all of it."""
        self._raise_if_finalized()
        for library in dict.fromkeys(self._linking_libraries):
            self._reload_init.update(library._reload_init)
            self._final_module.link_in(library._get_module_for_linking(), preserve=True)
        self._finalize_dynamic_globals()
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        """No function has an address."""
        del name
        return 0

    def serialize_using_object_code(self) -> Any:
        """What is kept: no machine code."""
        return self.serialize_using_bitcode()


def _compile_parts_once() -> None:
    """Let numba make a `_Part` of parts; what it compiles for others stays as it is.

    Parts have no environment: what raises errors with words of the moment, or prints, would, and allocates.
    """
    made: Any = codegen.JITCPUCodegen
    create, set_env = made.create_library, made.set_env

    def part_or_whole(self: Any, name: str, **options: Any) -> Any:
        return _Part(self, name) if _part.get() else create(self, name, **options)

    def set_where_it_is(self: Any, name: str, environment: Any) -> None:
        if self._engine.is_symbol_defined(name):
            set_env(self, name, environment)

    made.create_library, made.set_env = part_or_whole, set_where_it_is


_QUICK: dict[str, Any] = {}
if KNOWN:
    from kedfem.passes_kernel import Quick, ask_once

    _compile_parts_once()
    ask_once()
    _QUICK = {"pipeline_class": Quick}
_FAST: dict[str, Any] = {
    "cache": True, "nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True,
    "fastmath": {"reassoc", "contract", "nsz"},
}  # fmt: skip
compiled = _kept(_FAST)
_INNER: dict[str, Any] = {**_FAST, **_QUICK, "no_cpython_wrapper": True, "_nrt": False}
inner = _kept(_INNER)
"""Called by compiled loops only, and allocates nothing, so that no references are counted: compiled in less time."""
