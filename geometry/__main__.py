"""Draw the parts anew and write their STEP files: `python -m geometry [NAME ...]`, without names all of them."""

import sys

from geometry import PARTS, crank_train, engine
from geometry.make import HERE, write_part

ASSEMBLIES = {whole.NAME: whole.write for whole in (engine, crank_train)}

for name in sys.argv[1:] or (*PARTS, *ASSEMBLIES):
    if name in ASSEMBLIES:
        ASSEMBLIES[name](HERE)
    else:
        write_part(name, HERE)
    sys.stdout.write(f"geometry/{name}.step\n")
