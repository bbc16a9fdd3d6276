"""CAD files that are broken, odd or in other units; each function writes one into a folder and returns its path.

The sound part of reference is `bored_plate`: 60 x 20 x 10 mm, two bores of 8 mm at (10, 10) and (50, 10) along z.
"""

import re
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import gmsh
from geometry.drawing import box, disc, joined, prism, without
from geometry.make import empty_model
from geometry.step_files import write_step

MM_PER_INCH = 25.4
MM_PER_METRE = 1000.0
UNIT = r"\( LENGTH_UNIT\(\) NAMED_UNIT\(\*\) SI_UNIT\(\.MILLI\.,\.METRE\.\) \)"


def bored_plate(occ: ModuleType, mm: float = 1.0) -> int:
    """The sound part, drawn in a unit in which a millimetre is so long."""
    bores = [disc(occ, (x * mm, 10 * mm, 4 * mm), (-1 * mm, 11 * mm)) for x in (10, 50)]
    return without(occ, box(occ, (0, 60 * mm), (0, 20 * mm), (0, 10 * mm)), bores)


def sound(folder: Path) -> Path:
    """The sound part in millimetres."""
    return _step(folder / "sound.step", bored_plate)


def empty(folder: Path) -> Path:
    """A STEP file of no bytes."""
    return _text(folder / "empty.step", "")


def no_step(folder: Path) -> Path:
    """Text that is no STEP."""
    return _text(folder / "no_step.step", "This is a letter, not a part.\n")


def binary(folder: Path) -> Path:
    """Bytes that are no text."""
    path = folder / "binary.step"
    path.write_bytes(bytes(range(256)) * 40)
    return path


def truncated(folder: Path) -> Path:
    """The first half of a STEP file, as a broken transfer leaves it."""
    path = sound(folder)
    text = path.read_text(encoding="utf-8")
    path.unlink()
    return _text(folder / "truncated.step", text[: len(text) // 2])


def header_only(folder: Path) -> Path:
    """A correct STEP file that holds nothing."""
    return _text(
        folder / "header_only.step",
        "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION((''),'2;1');\nFILE_NAME('','',(''),(''),'','','');\n"
        "FILE_SCHEMA(('AUTOMOTIVE_DESIGN { 1 0 10303 214 1 1 1 1 }'));\nENDSEC;\nDATA;\nENDSEC;\nEND-ISO-10303-21;\n",
    )


def shells(folder: Path) -> Path:
    """The faces of a part, without a solid."""

    def faces(occ: ModuleType) -> None:
        occ.remove([(3, bored_plate(occ))])

    return _written(folder / "shells.step", faces)


def open_shell(folder: Path) -> Path:
    """A part's faces but one, without a solid: what a designer forgot to close."""

    def faces(occ: ModuleType) -> None:
        occ.remove([(3, bored_plate(occ))])
        occ.remove([occ.getEntities(2)[0]])

    return _written(folder / "open_shell.step", faces)


def gap(folder: Path, width: float) -> Path:
    """The faces of a block of 60 x 20 x 10 mm without a solid, the top one so many mm above the others."""

    def faces(occ: ModuleType) -> None:
        occ.remove([(3, box(occ, (0, 60), (0, 20), (0, 10)))])
        occ.synchronize()
        (top,) = [face for face in occ.getEntities(2) if occ.getCenterOfMass(*face)[2] > 9]
        occ.translate(occ.copy([top]), 0, 0, width)
        occ.remove([top])

    return _written(folder / "gap.step", faces)


def sliver(folder: Path) -> Path:
    """A block with a step of half a micrometre along one side."""

    def stepped(occ: ModuleType) -> None:
        joined(occ, [box(occ, (0, 60), (0, 20), (0, 10)), box(occ, (0, 60), (20, 20.0005), (0, 9.9))])

    return _written(folder / "sliver.step", stepped)


def wires(folder: Path) -> Path:
    """A sketch: edges only."""
    return _written(folder / "wires.step", lambda occ: occ.addCircle(0, 0, 0, 10))


def two_solids(folder: Path) -> Path:
    """Two solids apart, with the products' names left and right."""
    return _step(folder / "two_solids.step", _pair, ("left", "right"))


def same_names(folder: Path) -> Path:
    """Two solids apart with one name."""
    return _step(folder / "same_names.step", _pair, ("arm", "arm"))


def _pair(occ: ModuleType) -> None:
    bored_plate(occ)
    box(occ, (100, 120), (0, 20), (0, 10))


def overlapping(folder: Path) -> Path:
    """Two solids that share some of their volume."""

    def pair(occ: ModuleType) -> None:
        bored_plate(occ)
        box(occ, (40, 90), (5, 15), (5, 20))

    return _step(folder / "overlapping.step", pair, ("first", "second"))


def self_crossing(folder: Path) -> Path:
    """An extrusion of an outline that crosses itself: the sides cut through each other."""

    def crossed(occ: ModuleType) -> None:
        corners = [(0.0, 0.0), (60.0, 0.0), (20.0, 40.0), (45.0, 40.0)]
        prism(occ, [((x, y, 0.0), None) for x, y in corners], (0, 10))

    return _written(folder / "self_crossing.step", crossed)


def thin_sheet(folder: Path) -> Path:
    """A sheet 5 um thin."""
    return _step(folder / "thin_sheet.step", lambda occ: box(occ, (0, 100), (0, 40), (0, 0.005)))


def thin_fin(folder: Path) -> Path:
    """An ordinary block with a fin 5 um thin."""

    def finned(occ: ModuleType) -> None:
        joined(occ, [bored_plate(occ), box(occ, (60, 90), (5, 15), (5, 5.005))])

    return _step(folder / "thin_fin.step", finned)


def no_bore(folder: Path) -> Path:
    """A block without any round face."""
    return _step(folder / "no_bore.step", lambda occ: box(occ, (0, 60), (0, 20), (0, 10)))


def in_inches(folder: Path) -> Path:
    """The sound part, its file in inches."""
    path = _step(folder / "in_inches.step", lambda occ: bored_plate(occ, 1 / MM_PER_INCH))
    text = path.read_text(encoding="utf-8")
    last = max(int(number) for number in re.findall(r"#(\d+) =", text))
    inch = f"( CONVERSION_BASED_UNIT('INCH',#{last + 1}) LENGTH_UNIT() NAMED_UNIT(#{last + 2}) )"
    more = (
        f"#{last + 1} = LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE({MM_PER_INCH}),#{last + 3});\n"
        f"#{last + 2} = DIMENSIONAL_EXPONENTS(1.,0.,0.,0.,0.,0.,0.);\n"
        f"#{last + 3} = ( LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT(.MILLI.,.METRE.) );\n"
    )
    text = re.sub(UNIT, inch, text)
    return _text(path, re.sub(r"ENDSEC;\s*END-ISO", more + "ENDSEC;\nEND-ISO", text))


def in_metres(folder: Path) -> Path:
    """The sound part, its file in metres."""
    return _relabelled(_step(folder / "in_metres.step", lambda occ: bored_plate(occ, 1 / MM_PER_METRE)))


def thousandfold(folder: Path) -> Path:
    """The sound part drawn in millimetres, its file says metres: 60 m long."""
    return _relabelled(_step(folder / "thousandfold.step", bored_plate))


def brep(folder: Path) -> Path:
    """The sound part in OpenCASCADE's own format, which has no unit."""
    return _written(folder / "sound.brep", bored_plate)


def iges(folder: Path) -> Path:
    """The sound part in IGES: its faces, which a reader has to sew together."""
    return _written(folder / "sound.iges", bored_plate)


def wrong_ending(folder: Path) -> Path:
    """A BREP file that says that it is STEP."""
    return brep(folder).rename(folder / "wrong_ending.step")


def _relabelled(path: Path) -> Path:
    """The same numbers, now metres."""
    metre = "( LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT($,.METRE.) )"
    return _text(path, re.sub(UNIT, metre, path.read_text(encoding="utf-8")))


def _step(path: Path, draw: Callable[[ModuleType], object], names: tuple[str, ...] = ("plate",)) -> Path:
    with empty_model() as occ:
        draw(occ)
        occ.synchronize()
        write_step(path, names)
    return path


def _written(path: Path, draw: Callable[[ModuleType], object]) -> Path:
    """As gmsh writes it, whatever it is."""
    with empty_model() as occ:
        draw(occ)
        occ.synchronize()
        gmsh.write(str(path))
    return path


def _text(path: Path, text: str) -> Path:
    path.write_text(text, encoding="utf-8")
    return path


BAD = (
    empty,
    no_step,
    binary,
    truncated,
    header_only,
    shells,
    open_shell,
    wires,
    two_solids,
    same_names,
    overlapping,
    self_crossing,
    thin_sheet,
    thin_fin,
    no_bore,
    thousandfold,
    wrong_ending,
)
GOOD = (sound, in_inches, in_metres, brep, iges)
