"""Variants of a study of speed against error: kinds of models, meshes, tolerances of the reduction, steps."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

from kedfem.accuracy.variants import Family, families, of_family, refined, with_analysis, with_links, with_steps
from kedfem.scene import LinkScene, MeshFile, Scene, scene_from, time_grid

FINENESS, STEPS, TOLERANCES = (1.0, 1.5, 2.0, 3.0), (1, 2, 4), (1e-2, 1e-3, 1e-4)
TIGHT = 3e-5  # tolerance of a reduced reference


@dataclass(frozen=True, slots=True)
class ModelKind:
    """The models of the links of a variant.

    family : that of all links that have a shape and are not rigid in the scene
    reduced : whether these links are reduced to a few modes
    rigid : a link that is rigid in addition
    """

    family: Family
    reduced: bool = False
    rigid: str | None = None

    @property
    def name(self) -> str:
        """Its description."""
        return f"{'reduced ' if self.reduced else ''}{self.family}{', rigid crank' if self.rigid else ''}"


@dataclass(frozen=True, slots=True)
class Variant:
    """One variant of a scene.

    fineness : factor by which elements are smaller than the scene's
    steps : factor on the scene's number of steps
    tolerance : of the reduction, if there is one [-]
    """

    model_kind: ModelKind
    fineness: float = 1.0
    steps: int = 1
    tolerance: float | None = None

    @property
    def name(self) -> str:
        """Its description."""
        reduction = "" if self.tolerance is None else f", reduction {self.tolerance:.0e}"
        return f"{self.model_kind.name}, mesh × {self.fineness:g}, steps × {self.steps}{reduction}"


def model_kinds(scene: Scene) -> list[ModelKind]:
    """The kinds that all links' shapes allow, cheapest family first; the last one also with the driven link rigid."""
    each = [families(link) for link in _shaped(scene)]
    kinds: tuple[Family, ...] = ("beam", "plane", "solid")
    common = [family for family in kinds if each and all(family in f for f in each)]
    out = [ModelKind(family, reduced) for family in common for reduced in (False, True)[: 1 + (family != "beam")]]
    pair = scene.joints[scene.driven].links if scene.driven else ()
    driven = next((name for name in pair if name in scene.links), None)
    if driven and len(each) > 1 and scene.links[driven] in _shaped(scene):
        out += [replace(found, rigid=driven) for found in out[-1:]]
    return out


def _shaped(scene: Scene) -> list[LinkScene]:
    return [link for link in scene.links.values() if link.shape is not None and link.model != "rigid"]


def varied(scene: Scene, variant: Variant) -> Scene:
    """The scene of a variant, validated."""
    model_kind = variant.model_kind
    links = {
        name: of_family(link, "rigid") if name == model_kind.rigid else _modelled(link, variant)
        for name, link in scene.links.items() if link.shape is not None and link.model != "rigid"
    }  # fmt: skip
    keys = {"accuracy": "quick", "reduction_tolerance": variant.tolerance or scene.analysis.reduction_tolerance}
    changed = with_analysis(with_links(scene, links), **keys)
    if variant.steps != 1:
        changed = with_steps(changed, variant.steps * time_grid(scene).steps)
    return scene_from(changed.model_dump(exclude_unset=True), scene.folder)


def _modelled(link: LinkScene, variant: Variant) -> LinkScene:
    """A link modelled as a variant says; it keeps its own mesh if it is of that family already."""
    family, reduced = variant.model_kind.family, variant.model_kind.reduced
    if link.model != family:
        link = of_family(link, family, reduced)
    link = link.model_copy(update={"reduction": "modal" if reduced else "none"})
    return refined(link, variant.fineness)


def first_variants(scene: Scene) -> list[Variant]:
    """Every kind of model with the scene's own mesh, step and tolerance."""
    return [_with_tolerance(Variant(each), scene.analysis.reduction_tolerance) for each in model_kinds(scene)]


def reference_variant(scene: Scene, fineness: float, steps: int) -> Variant:
    """The most accurate variant: the last family, with a small tolerance of the reduction if that is faster."""
    best = [each for each in model_kinds(scene) if each.rigid is None][-1]
    return _with_tolerance(Variant(best, fineness, steps), TIGHT)


def _with_tolerance(variant: Variant, tolerance: float) -> Variant:
    return replace(variant, tolerance=tolerance if variant.model_kind.reduced else None)


def coarser(variant: Variant) -> Iterator[tuple[str, float, Variant]]:
    """The next coarser variant in each direction: its name, the factor, and the variant."""
    mesh = [f for f in FINENESS if f < variant.fineness]
    if mesh:
        yield "mesh", variant.fineness / mesh[-1], replace(variant, fineness=mesh[-1])
    if variant.steps > 1:
        yield "step", 2.0, replace(variant, steps=variant.steps // 2)


def further_variants(scene: Scene, reference: Variant) -> list[Variant]:
    """Variants that change one thing of the scene's own or of the reference, and those that refine all together."""
    out: list[Variant] = []
    more = [s for s in STEPS if 1 < s <= reference.steps]
    for first in first_variants(scene):
        if first.model_kind.rigid is not None:  # its error is not that of mesh, step or modes
            continue
        finest = reference.fineness if first.model_kind.family == reference.model_kind.family else FINENESS[-1]
        finer = [f for f in FINENESS if 1.0 < f <= finest]
        out += [replace(first, fineness=f) for f in finer]
        out += [replace(first, steps=s) for s in more]
        out += [replace(first, fineness=f, steps=s) for f, s in zip(finer, more, strict=False)]
        if first.tolerance is not None:
            out += [replace(first, tolerance=tolerance) for tolerance in TOLERANCES]
            out += [
                replace(first, fineness=f, steps=s, tolerance=TOLERANCES[-1]) for f, s in zip(finer, more, strict=False)
            ]
    out += [replace(reference, fineness=f) for f in FINENESS if f <= reference.fineness]
    out += [replace(reference, steps=s) for s in (1, *more)]
    return list(dict.fromkeys(out))


def exponent(scene: Scene, model_kind: ModelKind) -> float:
    """Power of the fineness with which the unknowns of a variant grow."""
    fixed = all(isinstance(link.shape, MeshFile) for link in _shaped(scene))
    return 0.0 if fixed else {"beam": 1.0, "plane": 2.0, "solid": 3.0}.get(model_kind.family, 0.0)
