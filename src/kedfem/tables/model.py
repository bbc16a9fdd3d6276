"""Tables of the model: sizes, links and their meshes, assembly and mobility; of a single part from CAD."""

from collections.abc import Iterable, Iterator, Sequence

import numpy as np
from rich.table import Table
from rich.text import Text

from kedfem.accuracy.sizes import Sizes
from kedfem.arrays import Float
from kedfem.dynamics.model import Model, mesh_methods, segments
from kedfem.links.record import Link
from kedfem.links.surfaces.part_candidates import PartCandidate
from kedfem.mesh import QuadMesh, SolidMesh, mesh_quality
from kedfem.mesh.cad.words import direction_in_words
from kedfem.mesh.places import in_mm
from kedfem.motion.assembly import Assembly
from kedfem.motion.dead_point import DeadPoint
from kedfem.motion.linkage import Linkage
from kedfem.motion.messages import position_in_words
from kedfem.motion.mobility import Mobility
from kedfem.motion.released_motions import joints_in_words
from kedfem.motion.released_motions import remedy as held_by
from kedfem.output.words import with_prefix
from kedfem.results.modelled import ELEMENTS, element_facts
from kedfem.scene import Scene
from kedfem.tables.layout import facts, left, listed, right

CLOSE = np.radians(20.0)  # of a dead point: forces of three times the load and more
FAR = np.radians(30.0)  # of a dead point: farther away estimates are rough


def size_line(found: Sizes) -> str:
    """Overall size, longest and shortest link, masses, moduli, speeds, in one line, in which a wrong unit is noticeable.

    >>> lengths, masses = {"crank": 0.1, "rod": 0.3}, {"crank": 0.16, "rod": 0.5}
    >>> size_line(Sizes(0.42, lengths, masses, {"steel": 2.1e11}, {"A": 600.0}, {}))
    'sizes: 420 mm overall; links 100 mm (crank) to 300 mm (rod); masses 0.16 to 0.5 kg; E 210 GPa; drive 600 rpm'
    """
    lines = [f"{with_prefix(found.overall, 'm')} overall"]
    if found.lengths:
        low, high = (pick(found.lengths, key=lambda x: found.lengths[x]) for pick in (min, max))
        ends = [f"{with_prefix(found.lengths[x], 'm')} ({x})" for x in dict.fromkeys((low, high))]
        lines.append(f"links {' to '.join(ends)}")
    lines += [f"masses {_range(found.masses.values(), 'kg')}"] if found.masses else []
    lines += [f"E {_range(found.moduli.values(), 'Pa')}"] if found.moduli else []
    speeds = [f"{x:.4g} rpm" for x in found.turns.values()]
    speeds += [with_prefix(x, "m/s") for x in found.speeds.values()]
    lines += [f"drive{'s' if len(speeds) > 1 else ''} {', '.join(speeds)}"] if speeds else []
    return "sizes: " + "; ".join(lines)


def _range(values: Iterable[float], unit: str) -> str:
    """The least and the greatest."""
    low, high = min(values := list(values)), max(values)
    if unit == "kg":  # 0.16 kg reads better than 160 mkg
        return f"{low:.4g} kg" if low == high else f"{low:.4g} to {high:.4g} kg"
    return with_prefix(low, unit) if low == high else f"{with_prefix(low, unit)} to {with_prefix(high, unit)}"


def assembly_table(assembly: Assembly) -> Table:
    """Misfits of joints that were given apart, and the motions of links that close them."""
    apart = sorted(assembly.misfits.items(), key=lambda each: -each[1])
    return facts("Assembly", [
        *((f"joint {name}", f"given {with_prefix(misfit, 'm')} apart") for name, misfit in apart),
        *((f"link {name}", f"moved {with_prefix(way, 'm')}, rotated {np.degrees(turn):.3g}°")
          for name, (way, turn) in assembly.moved.items() if apart),
    ])  # fmt: skip


def link_tables(model: Model) -> list[Table]:
    """The model of each link; meshing methods of parts from CAD, with reasons."""
    rows = [
        (name, *map(str, element_facts(parts).values()), _mass(*parts), _quality(*parts))
        for name, parts in segments(model).items()
    ]
    rows += [(x.link.name, "rigid, with the drive", "-", "0", _mass(x.link), "-") for x in model.prescribed]
    joined = f"{model.unknowns} unknowns in all, {model.coordinates} generalised coordinates once joined"
    caption = f"{joined}; mass: with what is attached; quality: worst scaled Jacobian"
    columns = [*left("link", "kind"), *right("elements", "unknowns", "mass", "quality")]
    methods = ((name, Text(method)) for name, method in mesh_methods(model).items())
    return [listed("Links", columns, rows, caption=caption), facts("Meshes of parts from CAD", methods)]


def _mass(*parts: Link) -> str:
    return f"{sum(float(link.one @ link.m1[:, 0]) for link in parts):.4g} kg"


def _quality(*parts: Link) -> str:
    """The worst scaled Jacobian of a meshed link."""
    full = [link.full or link for link in parts]
    if not full[0].meshed:
        return "-"
    plane = full[0].kind == "plane"
    meshes = (QuadMesh(x.X, x.cells, x.thickness) if plane else SolidMesh(x.X, x.cells) for x in full)
    return f"{min(mesh_quality(mesh).least for mesh in meshes):.2f}"


def mobility_table(scene: Scene, link: Linkage, found: Mobility, works: bool = False) -> Table:
    """Degrees of freedom, redundant constraints, free motions, and the nearest dead point.

    Parameters
    ----------
    works : whether a run's first steps succeed, so that free motions are intended
    """
    driven = f"driven at {joints_in_words(tuple(scene.driven_joints))}" if found.drives else "none driven"
    twice = f"{found.redundancy} of them redundant" if found.redundancy else "none redundant"
    rows = [("degrees of freedom", f"{found.freedom}, {driven}"), ("joint equations", f"{found.equations}, {twice}")]
    rows += [(f"constrained redundantly at {joints_in_words(each.joints)}", each.words) for each in found.redundant]
    if found.redundancy:
        rows.append(("without these", found.remedy))
    if found.free:
        rows.append(("free motions", str(sum(motion.basis.shape[1] for motion in found.free))))
    for motion in found.free:
        rows.append(("free", motion.words))
        if found.drives and not works:
            rows.append(("to constrain it", held_by(motion)))
    rows += _dead_point(link, found.dead_point)
    return facts(f"Mobility (in the reference position{', in its plane' * found.plane})", rows)


def _dead_point(link: Linkage, found: DeadPoint | None) -> Iterator[tuple[str, str]]:
    if found is None:
        return
    off = f"{np.degrees(FAR):.0f}° or more from it"
    if found.joint is not None and found.off < FAR:
        off = f"joint {found.joint} about {np.degrees(found.off):.2g}° from it"
    condition = f"smallest singular value {found.reciprocal_condition:.2g} of the largest"
    yield "closest to a dead point", f"at {position_in_words(link, found.tau, '.4g')}, {off} (estimated; {condition})"
    if found.outside is not None:
        apart, near = _apart(link, abs(found.outside - found.tau)), position_in_words(link, found.outside, ".3g")
        yield "dead point outside the range", f"about {apart} from its end, near {near} (estimated)"
    if (found.joint is not None and found.off < CLOSE) or found.outside is not None:
        remedy = "drive another joint, limit the drive, or let a flywheel carry the linkage through"
        yield "to keep away from it", remedy


def _apart(link: Linkage, x: float) -> str:
    """A length of the path in words."""
    if len(link.drives) != 1:
        return with_prefix(x, "s")
    return f"{np.degrees(x):.2g}°" if link.drives.turning[0] else with_prefix(x, "m")


def mesh_tables(name: str, mesh: SolidMesh, found: Sequence[PartCandidate]) -> list[Table]:
    """A single part: meshing method, faces for joints, quality of its elements."""
    quality = mesh_quality(mesh)
    sides = mesh.points.max(axis=0) - mesh.points.min(axis=0)
    table = facts(Text(name), [
        ("method", Text(mesh.method)),
        ("elements", f"{len(mesh.cells)} {ELEMENTS[mesh.cell_type]}"),
        ("unknowns", str(3 * len(mesh.points))),
        ("extent", " × ".join(with_prefix(float(side), "m") for side in sides)),
        ("worst scaled Jacobian", f"{quality.least:.3f} at {in_mm(quality.centre)}"),
    ])  # fmt: skip
    edges, counts = quality.histogram()
    bars = facts("Scaled Jacobian of the elements", (
        (f"{low:.1f}", str(count), "█" * int(np.ceil(40 * count / counts.max())))
        for count, low in zip(counts, edges, strict=False) if count
    ))  # fmt: skip
    return [table, _surfaces(found), bars]


def _surfaces(found: Sequence[PartCandidate]) -> Table:
    """Faces for joints, by the numbers in the picture."""
    caption = (
        "mm; numbers as in the picture; what a joint finds that is put there, of round faces about their axis. "
        "Others by joints.NAME.faces: the face's name, or what it is: "
        '{ cylinder = "8 mm", axis = "z", near = [0.05, 0, 0] }'
    )
    names = left("face", no_wrap=True)  # names are for copying: other columns are wrapped
    columns = [*right("no"), *names, *left("what"), *right("⌀", "at"), *left("axis", "finds")]
    table = listed("What joints can sit on", columns, caption=caption)
    for each in found:
        diameter = "" if np.isnan(each.face.radius) else f"{2e3 * each.face.radius:.4g}"
        axis = "" if np.isnan(each.face.direction).any() else direction_in_words(each.face.direction)
        at = _shown(1e3 * each.at, 1 if each.kind == "plane" else 2)
        table.add_row(str(each.number), Text(each.face.name), each.kind, diameter, at, axis, each.finds)
    return table


def _shown(x: Float[np.ndarray, "3"], digits: int) -> str:
    """A point or direction, rounded."""
    return "({:g}, {:g}, {:g})".format(*(np.round(x, digits) + 0.0))
