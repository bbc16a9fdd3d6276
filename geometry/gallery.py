"""``python -m geometry.gallery`` meshes all parts as they come and writes docs/pictures/parts.png and docs/parts.md."""

import sys
from pathlib import Path

from geometry import PARTS
from kedfem.links.surfaces.part_candidates import face_kind
from kedfem.mesh import SolidMesh, mesh_quality, part_mesh
from kedfem.output.mesh_picture import write_mesh_picture
from kedfem.scene import link_from

HERE, DOCS = Path(__file__).parent, Path(__file__).parents[1] / "docs"
HEAD = """# The parts of geometry/, meshed

Written by `python -m geometry.gallery`: every STEP file of geometry/ with default sizes, unattended.

![All parts](pictures/parts.png)

| part | method | elements | unknowns | worst scaled Jacobian | bores and balls found |
|---|---|---:|---:|---:|---:|
"""


def main() -> None:
    """Mesh, measure and draw all parts."""
    drawn: list[tuple[str, SolidMesh]] = []
    lines = []
    for name in PARTS:
        mesh = part_mesh(link_from({"shape": {"kind": "cad", "file": f"{name}.step"}, "material": "steel"}), HERE)
        least = mesh_quality(mesh).least
        surfaces = sum(face_kind(mesh, face) in {"bore", "ball seat", "ball"} for face in mesh.faces)
        lines.append(
            f"| {name} | {mesh.method} | {len(mesh.cells):,} | {3 * len(mesh.points):,} | {least:.2f} | {surfaces} |"
        )
        drawn.append((f"{name}\n{len(mesh.cells):,} elements, worst {least:.2f}", mesh))
        sys.stdout.write(lines[-1] + "\n")
        sys.stdout.flush()
    write_mesh_picture(drawn, DOCS / "pictures" / "parts.png", "Parts of geometry/ at default sizes")
    (DOCS / "parts.md").write_text(HEAD + "\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
