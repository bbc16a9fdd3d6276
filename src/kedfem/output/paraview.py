"""A state for ParaView that opens a run's files: a Python script for File > Load State."""

from pathlib import Path
from string import Template

import numpy as np

from kedfem.output.fields import DISPLACEMENT, DRIVE_FORCE, DRIVE_TORQUE, FORCE, JOINTS, VON_MISES
from kedfem.output.stress_files import ENVELOPE, KINDS
from kedfem.results import Peak, Results, replacing
from kedfem.results.table import drive_heading
from kedfem.scene import Scene, driven_travel

STATE = "paraview.py"
ARROW = 0.2  # length of the longest arrow, in sizes of the mechanism
TEXT = Template('''"""Opens the results beside this file in ParaView 5.11 or later.

File > Load State, or paraview --script=$state
"""

import os

import paraview
from paraview.simple import *

here = os.path.dirname(os.path.abspath(__file__)) if "__file__" in globals() else $folder
LoadPalette("WhiteBackground")
view = GetActiveViewOrCreate("RenderView")
animation = PVDReader(registrationName="animation", FileName=os.path.join(here, "animation.pvd"))
animation.UpdatePipeline()
GetAnimationScene().UpdateAnimationUsingDataTimeSteps()
GetAnimationScene().GoToFirst()

shown = Show(animation, view)
ColorBy(shown, ("POINTS", "$stress"))
colours = GetColorTransferFunction("$stress")
colours.ApplyPreset("Turbo", True)
colours.RescaleTransferFunction(0.0, $highest)
colours.NanColor = [0.7, 0.7, 0.7]
shown.SetScalarBarVisibility(view, True)
$arrows
position = $position
if position:
    note = PythonAnnotation(registrationName="drive", Input=animation)
    note.ArrayAssociation = "Field Data"
    note.Expression = "'%s  %.4g' % ('" + position + "', " + paraview.make_name_valid(position) + "[0])"
    Show(note, view).FontSize = 16
time = AnnotateTimeFilter(registrationName="time", Input=animation)
time.Format = "t = {time:.5g} s"
Show(time, view).WindowLocation = "Upper Right Corner"

envelope = os.path.join(here, "$envelope")
if os.path.exists(envelope):  # in the reference position; switch it on in the pipeline
    highest = XMLUnstructuredGridReader(registrationName="envelope, undeformed", FileName=[envelope])
    ColorBy(Show(highest, view), ("POINTS", "$kind"))
    Hide(highest, view)
whole = os.path.join(here, "animation.vtkhdf")
if os.path.exists(whole) and GetParaViewVersion() >= 5.12:  # not exaggerated: Warp By Vector with the scale you like
    rigid = VTKHDFReader(registrationName="rigid motion", FileName=whole)
    warped = WarpByVector(registrationName="deflected", Input=rigid)
    warped.Vectors = ["POINTS", "$displacement"]
    Hide(rigid, view)
    Hide(warped, view)
ResetCamera(view)
Render(view)
''')
BLOCK = Template("""
joints = ExtractBlock(registrationName="joints", Input=animation)
joints.Selectors = ["/Root/$block"]
low, high = (animation.GetDataInformation().GetBounds()[k::2] for k in (0, 1))
size = sum((b - a) ** 2 for a, b in zip(low, high)) ** 0.5
""")
ARROWS = Template("""
arrows = Glyph(registrationName="$title", Input=joints, GlyphType="Arrow")
arrows.OrientationArray = ["POINTS", "$array"]
arrows.ScaleArray = ["POINTS", "$array"]
arrows.ScaleFactor = $share * size / $largest
arrows.GlyphMode = "All Points"
drawn = Show(arrows, view)
drawn.ColorArrayName = ["POINTS", ""]
drawn.AmbientColor = drawn.DiffuseColor = $colour
""")
COLOURS = ([0.8, 0.1, 0.1], [0.1, 0.2, 0.8], [0.1, 0.6, 0.2])


def write_state(scene: Scene, results: Results, peak: Peak | None, folder: Path) -> None:
    """Write the state into the animation's folder.

    Parameters
    ----------
    peak : highest stress, which is the upper end of the colours
    """
    text = TEXT.substitute(
        state=STATE, folder=repr(str(folder.resolve())), stress=VON_MISES, highest=peak.stress if peak else 1.0,
        arrows=_arrows(scene, results), position=repr(drive_heading(results.drive) if scene.driven else ""),
        envelope=ENVELOPE, kind=f"{KINDS[0]} stress [Pa]", displacement=DISPLACEMENT,
    )  # fmt: skip
    with replacing(folder / STATE) as part:
        part.write_text(text, encoding="utf-8")


def _arrows(scene: Scene, results: Results) -> str:
    """Script of the arrows of joint forces and drive efforts, the longest of each a share of the mechanism's size."""
    forces = [f"joints/{name}/force" for name in scene.joints]
    slides = {driven_travel(scene, name) for name in scene.all_drives}
    drives = {
        array: [name for name in results.channels if name.startswith("drive/") and name.endswith(f"/{what}")]
        for array, what, there in ((DRIVE_FORCE, "force", True), (DRIVE_TORQUE, "torque", False))
        if there in slides
    }
    out = []
    for (array, names), colour in zip({FORCE: forces, **drives}.items(), COLOURS, strict=False):
        values = [results.largest_rows(name)[2] for name in names if name in results.channels]
        largest = max((float(np.linalg.norm(x, axis=1).max()) for x in values), default=0.0)
        if largest > 0:
            title, size = array if array != FORCE else f"joint {FORCE}", {"largest": largest, "share": ARROW}
            out.append(ARROWS.substitute(size, title=title, array=array, colour=colour))
    return BLOCK.substitute(block=JOINTS) + "".join(out) if out else ""
