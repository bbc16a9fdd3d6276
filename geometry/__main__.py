"""Draw the parts anew and write their STEP files: `python -m geometry [NAME ...]`, without names all of them."""

import sys

from geometry import PARTS, engine
from geometry.make import HERE, write_part

for name in sys.argv[1:] or (*PARTS, engine.NAME):
    if name == engine.NAME:
        engine.write(HERE)
    else:
        write_part(name, HERE)
    sys.stdout.write(f"geometry/{name}.step\n")
