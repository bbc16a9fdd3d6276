"""A four-bar as exact as one percent; run with `python examples/four_bar_accuracy/run.py`."""

from pathlib import Path

from kedfem.accuracy.histories import histories, relative_errors
from kedfem.accuracy.prepared import meshed
from kedfem.accuracy.reduction import prepared
from kedfem.accuracy.variants import of_family, refined, with_links, with_steps
from kedfem.analysis import analyse
from kedfem.scene import read_scene, time_grid


def main() -> None:
    scene = read_scene(Path(__file__).with_name("scene.toml"))
    run = analyse(scene)
    assert run.plan is not None
    print(f"expected error {100 * run.plan.error:.2g} %, of it")
    for share in run.plan.shares:
        print(f"  {share.what}: {100 * share.error:.2g} %")
    assert run.plan.reached
    # the promise against full solids, half as fine again, in twice as many steps
    chosen = run.plan.scene
    solids = {name: refined(of_family(link, "solid"), 1.5) for name, link in chosen.links.items()}
    finer = with_steps(with_links(chosen, solids), 2 * time_grid(chosen).steps)
    errors = relative_errors(histories(prepared(chosen)[0]), histories(meshed(finer)))
    for name, error in errors.items():
        print(f"{name}: {100 * error:.2g} % from full, finer solids in finer steps")
    assert max(errors.values()) < 0.01


if __name__ == "__main__":
    main()
