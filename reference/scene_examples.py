"""An example for each table of the scene reference; `tests/rooms/test_reference_examples.py` reads each in a whole scene.

Names are those of three scenes: a driven four-bar of `crank`, `coupler`, `rocker` with joints A to D; an `arm` that a
drive at A swings, with a `shoe` on a slide at S; an `arm`, `rod` and `shoe` that nothing drives, with joints A, B, C, S.
"""

EXAMPLES = {
    "The file": '''
title = "Four-bar"
include = ["materials.toml"]
gravity = [0, "-9.81 m/s^2"]

[parameters]
r = "25 mm"
''',
    "[points]": '''
[points]
A = [0, 0]
D = ["300 mm", 0]
B = { from = "A", distance = "100 mm", angle = "60 deg" }
C = { from = ["B", "D"], distances = ["300 mm", "250 mm"], side = "left" }
E = { from = "C", distance = "260 mm", along = ["A", "D"] }
M = { between = ["C", "D"], fraction = 0.5, offset = "12 mm" }
''',
    "[materials.NAME]": '''
[materials.aluminium_7075]
density = "2810 kg/m^3"
youngs_modulus = "71.7 GPa"
poisson_ratio = 0.33
yield_strength = "470 MPa"               # in T6
''',
    "[links.NAME]": '''
[links.coupler]
material = "steel"
reduction = "modal"                     # some twenty modes instead of all unknowns
shape = { kind = "bar", between = ["B", "C"], width = "20 mm", thickness = "10 mm" }
''',
    "[links.NAME.mesh]": '''
[links.coupler.mesh]
size = "5 mm"
layers = 2
''',
    "[links.NAME.shape]": '''
[links.coupler.shape]
kind = "plate_link"                     # a plate with a bore at each end
between = ["B", "C"]
width = "20 mm"
thickness = "10 mm"
eye_diameter = "30 mm"
bore_diameter = "12 mm"
''',
    "section of a polyline": '''
[links.coupler]
material = "steel"
model = "beam"

[links.coupler.shape]
kind = "polyline"
points = ["B", [0.16, 0.28], "C"]
section = { kind = "tube", diameter = "25 mm", wall = "2 mm" }
''',
    "Items of an outline, holes": '''
[links.rocker.shape]
kind = "extrusion"
outline = [[0.28, -0.02], [0.32, -0.02], [0.32, 0.26], { via = [0.3, 0.28], to = [0.28, 0.26] }]
holes = [{ at = "C", diameter = "10 mm" }, { at = "D", diameter = "10 mm" }]
thickness = "10 mm"
''',
    "The file of a part": '''
origin = [0, 0]                         # goes to the first point of `between`
x_point = ["250 mm", 0]                 # the x axis goes on to the second
thickness = "10 mm"
outline = [[-0.02, -0.015], [0.27, -0.015], [0.27, 0.015], [-0.02, 0.015]]
holes = [{ at = [0, 0], diameter = "10 mm" }, { at = [0.25, 0], diameter = "10 mm" }]
''',
    "[joints.NAME]": '''
[joints.B]
kind = "revolute"
links = ["crank", "coupler"]
at = "B"
coupling = "rigid"                      # the bore keeps its shape, as on a stiff pin
''',
    "A face by what it is": '''
[joints.C]
kind = "revolute"
links = ["coupler", "rocker"]
at = "C"
faces = { rocker = { cylinder = "10 mm", axis = "z", near = "C" } }
''',
    "bushing of a joint": '''
[joints.C]
kind = "revolute"
links = ["coupler", "rocker"]
at = "C"
bushing = { stiffness = "20 kN/mm", damping = "1 kN*s/m", rotational_stiffness = "500 N*m/rad" }
''',
    "[gears.NAME]": '''
[links.wheel]
model = "rigid"
material = "steel"
shape = { kind = "bar", between = [[-0.1, 0], [-0.1, 0.04]], width = "20 mm", thickness = "10 mm" }

[joints.W]
kind = "revolute"
links = ["ground", "wheel"]
at = [-0.1, 0]

[gears.pair]
joints = ["A", "W"]
ratio = -1.5
''',
    "[drive]": '''
[drive]
joint = "A"
motion = { kind = "constant_speed", speed = "600 rpm" }
shaft_stiffness = "2 kN*m/rad"
''',
    "[drive.motion]": '''
[drive.motion]
kind = "ramp"                           # from rest to the speed within the time
speed = "600 rpm"
time = "0.2 s"
''',
    "[motors.NAME]": '''
[motors.starter]
joint = "A"
torque = { over = "speed", at = [0, "600 rpm"], value = ["5 N*m", 0] }
''',
    "torque of a motor or a spring": '''
[motors.starter]
joint = "A"
torque = { over = "time", at = [0, "0.1 s", "0.2 s"], value = [0, "5 N*m", 0] }
''',
    "force of a motor": '''
[motors.ram]
joint = "S"
force = { over = "travel", at = ["0 mm", "5 mm"], value = [0, "10 N"] }
''',
    "[springs.NAME]": '''
[springs.return]
kind = "torsion"
joint = "B"
stiffness = "3 N*m/rad"
damping = 0.1
free_angle = "30 deg"
''',
    "force of a spring": '''
[springs.strut]                         # a spring with a damper whose force is measured
kind = "spring"
between = [{ link = "rod", at = [2, 0] }, { link = "ground", at = [2, 1] }]
stiffness = "2 N/mm"
force = { over = "speed", at = ["-0.5 m/s", 0, "0.5 m/s"], value = ["-300 N", 0, "900 N"], interpolation = "smooth" }
''',
    "Ends of a spring": '''
[springs.pull]
kind = "spring"
between = [{ link = "rod", at = [2, 0] }, { link = "ground", at = [2, 1] }]
stiffness = "2 N/mm"
''',
    "[limits.NAME]": '''
[limits.buffer]
kind = "travel"
joint = "S"
upper = "40 mm"
stiffness = "200 N/mm"
damping = "500 N*s/m"
''',
    "[loads.NAME]": '''
[loads.push]
kind = "force"
link = "rocker"
at = "C"
vector = [0, "-100 N"]
''',
    "factor of a load": '''
[loads.push]
kind = "force"
link = "rocker"
at = "C"
vector = [0, "-100 N"]
factor = { over = "angle", period = "360 deg", at = ["0 deg", "90 deg", "180 deg", "360 deg"], value = [0, 1, 0, 0] }
''',
    "[bodies.NAME]": '''
[bodies.flywheel]
kind = "flywheel"
link = "rocker"
at = "joints.D"
inertia = "0.08 kg*m^2"
''',
    "[patterns.NAME]": '''
[patterns.pendulums]
count = 3
rotation = "120 deg"                    # about z, if nothing else is said
centre = ["500 mm", 0]
points = { P = ["600 mm", 0], Q = ["700 mm", 0] }           # of pendulum_1; those of pendulum_2 are rotated by 120°

[patterns.pendulums.links.pendulum]
material = "steel"
model = "beam"
shape = { kind = "bar", between = ["P", "Q"], width = "10 mm", thickness = "10 mm" }

[patterns.pendulums.joints.hinge]
kind = "revolute"
links = ["ground", "pendulum"]
at = "P"
''',
    "[damping]": '''
[damping]
ratio = 0.02                            # of critical damping, at both frequencies
frequencies = ["10 Hz", "1 kHz"]
''',
    "[analysis]": '''
[analysis]
revolutions = 3
accuracy = 0.01                         # the step follows
initial = "quasi-static"
''',
    "[analysis.initial_motions.NAME]": '''
[analysis.initial_motions.rod]
at = [1, 0]
velocity = [0, "6 m/s"]
''',
    "[analysis.initial_deflection.NAME]": '''
[analysis]
initial = "quasi-static"

[analysis.initial_deflection.pluck]
link = "rocker"
at = "C"
force = ["50 N", 0]
''',
    "[fatigue]": '''
[fatigue]
required_life = "20000 h"

[fatigue.materials.steel]
group = "steel"
tensile_strength = "800 MPa"
''',
    "[fatigue.materials.NAME], [fatigue.links.NAME]": '''
[fatigue.materials.steel]               # of the FKM guideline, by name of the links' material
group = "steel"
tensile_strength = "800 MPa"
roughness = "12.5 um"

[fatigue.links.rocker]                  # or of one link: an S-N curve
endurance_stress = "220 MPa"
endurance_cycles = 2e6
slope = 6
mean_stress_sensitivity = 0.25
''',
    "strain_life of a material": '''
[fatigue.materials.steel]
mean_stress_sensitivity = 0.25

[fatigue.materials.steel.strain_life]
strength_coefficient = "900 MPa"
strength_exponent = -0.1
ductility_coefficient = 0.4
ductility_exponent = -0.6
''',
    "[output]": '''
[output]
folder = "run-1"
csv = true
plots = false
''',
    "[output.animation]": '''
[output.animation]
frames_per_revolution = 72
last_revolutions = 1
deformation_scale = 50
''',
    "[output.probes.NAME]": '''
[output.probes.middle]
link = "rocker"
at = { between = ["C", "D"] }
quantity = "displacement"
frame = "link"
''',
}  # fmt: skip
"""Heading of the section → TOML."""
