"""The scene: what a user describes, validated completely; SI units, points as coordinates."""

from kedfem.scene.analysis import Analysis, Animation, Output, Probe
from kedfem.scene.damping import Damping, rayleigh
from kedfem.scene.drives import (
    ConstantSpeed,
    Cycloidal,
    Drive,
    Gear,
    Harmonic,
    MotionLaw,
    Polynomial,
    Ramp,
    Table,
)
from kedfem.scene.faces import ChosenFace
from kedfem.scene.fatigue import Fatigue, FatigueData, StrainLife
from kedfem.scene.files import part_geometry
from kedfem.scene.frames import corotational, corotational_links, link_frames
from kedfem.scene.inertia import inertia_tensor, moments_of_inertia
from kedfem.scene.initial import InitialMotion
from kedfem.scene.laws import drive_angle, factor_table, factors, is_constant, load_factor, path_parameter
from kedfem.scene.links import DIRECTED, GROUND, ROTARY, Joint, LinkScene, Meshing, require_elastic
from kedfem.scene.loads import (
    Body,
    BodyLoad,
    Factor,
    Flywheel,
    ForceLoad,
    Load,
    PointMass,
    PressureLoad,
    RigidBody,
    SurfaceLoad,
    TorqueLoad,
)
from kedfem.scene.materials import Material
from kedfem.scene.motors import ForceCurve, Motor, TorqueCurve
from kedfem.scene.moving_joints import enforced_by_equations, moving_grounds
from kedfem.scene.outlines import Arc, Hole
from kedfem.scene.planes import spatial_beams
from kedfem.scene.read import face_from, link_from, material_from, read_keys, read_scene, scene_from
from kedfem.scene.scene import Scene
from kedfem.scene.sections import ConstantsSection, RectangleSection, RoundSection, SectionShape, TubeSection
from kedfem.scene.shapes import Bar, Cad, Extrusion, MeshFile, Part, PartGeometry, PlateLink, Polyline, Shape
from kedfem.scene.springs import LineSpring, Spring, SpringEnd, TorsionSpring
from kedfem.scene.stops import AngleLimit, Limit, TravelLimit
from kedfem.scene.timing import TimeGrid, cycle, time_grid, turn_steps, without_vibration

__all__ = [
    "DIRECTED",
    "GROUND",
    "ROTARY",
    "Analysis",
    "AngleLimit",
    "Animation",
    "Arc",
    "Bar",
    "Body",
    "BodyLoad",
    "Cad",
    "ChosenFace",
    "ConstantSpeed",
    "ConstantsSection",
    "Cycloidal",
    "Damping",
    "Drive",
    "Extrusion",
    "Factor",
    "Fatigue",
    "FatigueData",
    "Flywheel",
    "ForceCurve",
    "ForceLoad",
    "Gear",
    "Harmonic",
    "Hole",
    "InitialMotion",
    "Joint",
    "Limit",
    "LineSpring",
    "LinkScene",
    "Load",
    "Material",
    "MeshFile",
    "Meshing",
    "MotionLaw",
    "Motor",
    "Output",
    "Part",
    "PartGeometry",
    "PlateLink",
    "PointMass",
    "Polyline",
    "Polynomial",
    "PressureLoad",
    "Probe",
    "Ramp",
    "RectangleSection",
    "RigidBody",
    "RoundSection",
    "Scene",
    "SectionShape",
    "Shape",
    "Spring",
    "SpringEnd",
    "StrainLife",
    "SurfaceLoad",
    "Table",
    "TimeGrid",
    "TorqueCurve",
    "TorqueLoad",
    "TorsionSpring",
    "TravelLimit",
    "TubeSection",
    "corotational",
    "corotational_links",
    "cycle",
    "drive_angle",
    "enforced_by_equations",
    "face_from",
    "factor_table",
    "factors",
    "inertia_tensor",
    "is_constant",
    "link_frames",
    "link_from",
    "load_factor",
    "material_from",
    "moments_of_inertia",
    "moving_grounds",
    "part_geometry",
    "path_parameter",
    "rayleigh",
    "read_keys",
    "read_scene",
    "require_elastic",
    "scene_from",
    "spatial_beams",
    "time_grid",
    "turn_steps",
    "without_vibration",
]
