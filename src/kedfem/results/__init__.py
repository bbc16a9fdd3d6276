"""Results: time series of probes, joint forces and the drive, in HDF5 and CSV.

An incomplete file is never taken for a complete one, and a run that does not start loses no older results:

* A run claims its folder; a second run there is refused before it touches anything.
* A run writes to a part file with a name of its own; the first rows that reach the disk put it in place of an
  older ``NAME``.
  A run that fails earlier removes its own file and leaves the old one as it was.
* The file says ``status = "running"`` from then on, ``"complete"`` only after a clean end, and
  ``"interrupted"`` (with the reason) after an error, Ctrl-C or SIGTERM. A killed process leaves ``"running"``, and no
  lock: whoever reads the file gets ``"abandoned"``.
* A file whose bytes have changed is refused.
* Whatever the status, all rows up to the last :meth:`ResultsWriter.append` can be read.
"""

from kedfem.results.additions import add_notes
from kedfem.results.channels import Channel
from kedfem.results.files import claimed, ready_folder, replacing, results_file
from kedfem.results.reader import abandoned_rows, read_results, run_status
from kedfem.results.records import Fatigue, FatigueSpot, Peak, Results
from kedfem.results.table import write_csv, write_parquet
from kedfem.results.writer import ResultsWriter
