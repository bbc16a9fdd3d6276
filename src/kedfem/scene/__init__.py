"""The scene: a user's description of a mechanism, completely validated, in SI units, with points as coordinates."""

from kedfem.scene.questions.curves import Pieces, pieces
from kedfem.scene.questions.enforced import enforced_by_equations
from kedfem.scene.questions.geometry_files import geometry_files
from kedfem.scene.questions.laws import (
    curves,
    drive_angle,
    factor_law,
    factor_table,
    factors,
    is_constant,
    load_factor,
    path_parameter,
)
from kedfem.scene.questions.modelling import (
    corotational,
    corotational_links,
    driven_travel,
    link_frames,
    mass_place,
    masses_alone,
    moving_grounds,
    yield_strengths,
)
from kedfem.scene.questions.planes import plane_scene, spatial_beams
from kedfem.scene.questions.timing import TimeGrid, cycle, revolution_steps, states_step, time_grid, without_vibration
from kedfem.scene.read.files import part_geometry
from kedfem.scene.read.scenes import (
    face_from,
    link_from,
    material_from,
    read_keys,
    read_scene,
    refuse_few_rows,
    refuse_unsupported,
    scene_from,
)
from kedfem.scene.records.analysis import Analysis, Animation, InitialMotion, Output, Probe
from kedfem.scene.records.curves import Curve, Factor, ForceCurve, PullCurve, TorqueCurve
from kedfem.scene.records.drives import (
    ConstantSpeed,
    Cycloidal,
    Drive,
    Gear,
    Harmonic,
    MotionCurve,
    MotionLaw,
    Polynomial,
    Ramp,
)
from kedfem.scene.records.fatigue import Fatigue, FatigueData, StrainLife
from kedfem.scene.records.force_elements import (
    AngleLimit,
    Limit,
    LineSpring,
    Motor,
    Spring,
    SpringEnd,
    TorsionSpring,
    TravelLimit,
)
from kedfem.scene.records.joints import DIRECTED, ROTARY, ChosenFace, Joint
from kedfem.scene.records.links import GROUND, LinkScene, Meshing, require_elastic
from kedfem.scene.records.loads import (
    Body,
    BodyLoad,
    Flywheel,
    ForceLoad,
    LineLoad,
    Load,
    PointMass,
    PressureLoad,
    RigidBody,
    SurfaceLoad,
    TorqueLoad,
    inertia_tensor,
    moments_of_inertia,
)
from kedfem.scene.records.materials import Damping, Material, rayleigh
from kedfem.scene.records.outlines import Arc, Hole
from kedfem.scene.records.scene import Scene
from kedfem.scene.records.sections import (
    BoxSection,
    ConstantsSection,
    ISection,
    RectangleSection,
    RoundSection,
    SectionShape,
    TubeSection,
)
from kedfem.scene.records.shapes import Bar, Cad, Extrusion, MeshFile, Part, PartGeometry, PlateLink, Polyline, Shape
from kedfem.scene.records.wording import percentage
