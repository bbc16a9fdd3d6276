"""Points of a sweep on the workers of a running Dask scheduler."""

import os
from collections.abc import Callable
from concurrent.futures import Executor, Future
from pathlib import Path as FilePath
from typing import Any

from kedfem.errors import OutputError
from kedfem.results.layout import installed_version

PATIENCE = 10  # s, in which a scheduler must answer


class OnCluster(Executor):
    """The workers of a `distributed` client, each with one thread, as an executor for a sweep."""

    def __init__(self, client: Any) -> None:
        self._client, self._executor = client, client.get_executor(pure=False)
        self._max_workers = len(client.scheduler_info(n_workers=-1)["workers"])

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Submit a call to the workers."""
        future: Future[Any] = self._executor.submit(fn, *args, **kwargs)
        return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Wait for running points, or cancel them; the workers stay."""
        self._executor.shutdown(wait=wait and not cancel_futures)
        self._client.close()


def cluster(address: str, folder: FilePath) -> OnCluster:
    """The workers of a scheduler, as ``tcp://host:8786``, that see the files in a scene's folder.

    Raises
    ------
    OutputError
        `distributed` is not installed, no scheduler answers, it has no workers, or these cannot run points.
    """
    try:
        from distributed import Client
    except ImportError:
        raise OutputError("--cluster: needs dask.distributed: pip install 'kedfem[cluster]'") from None

    class Answered(Client):
        """A client that ends its thread if no scheduler answers."""

        def start(self, **how: Any) -> Any:
            try:
                return super().start(**how)  # type: ignore[no-untyped-call]
            except BaseException:
                self.status = "closed"  # else it closes once more as it is collected
                self._loop_runner.stop()  # type: ignore[no-untyped-call]
                raise

    try:
        client = Answered(address, timeout=PATIENCE, set_as_default=False)  # type: ignore[no-untyped-call]
    except (OSError, ValueError) as error:
        raise OutputError(
            "--cluster: must be the address of a Dask scheduler, such as tcp://host:8786, that answers within "
            f"{PATIENCE} s, got {address}: {error}"
        ) from None
    try:
        _refuse_unfit(client, folder.resolve())
    except BaseException:
        client.close()  # type: ignore[no-untyped-call]
        raise
    return OnCluster(client)


def _refuse_unfit(client: Any, folder: FilePath) -> None:
    workers = client.scheduler_info(n_workers=-1)["workers"]
    if not workers:
        got = "got a scheduler without any: start some with dask worker"
        raise OutputError(f"--cluster: must have workers, {got}")
    if busy := [name for name, worker in workers.items() if worker["nthreads"] != 1]:
        raise OutputError(
            f"--cluster: its workers must have one thread each, got {workers[busy[0]]['nthreads']} of {busy[0]}: "
            "start them with dask worker ... --nthreads 1"
        )
    try:
        found = client.run(_found_there, str(folder))
    except Exception as error:  # noqa: BLE001 - as a worker without kedfem raises it
        wanted = f"its workers must have kedfem {installed_version()}"
        raise OutputError(f"--cluster: {wanted}, got {error}") from None
    for name, (version, there) in found.items():
        if version != installed_version():
            wanted = f"its workers must have kedfem {installed_version()}"
            raise OutputError(f"--cluster: {wanted}, got {version or 'none'} at {name}")
        if not there:
            wanted = f"its workers must see the scene's folder {folder}"
            raise OutputError(f"--cluster: {wanted}, got one that does not: {name}")


def _found_there(folder: str) -> tuple[str, bool]:
    """kedfem's version at a worker, and whether a folder exists there."""
    return installed_version(), os.path.isdir(folder)  # noqa: PTH112 - runs at a worker, on plain text
