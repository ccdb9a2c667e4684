"""Tables as Parquet: what is read is what was written, and no thread outlives the reading."""

import subprocess
import sys
from pathlib import Path

import pandas as pd

from orchestrator import tables
from orchestrator.runs.folder import Folder

READ = """
import os, sys
from pathlib import Path
from orchestrator import tables
from orchestrator.runs.folder import Folder
before = len(os.listdir("/proc/self/task"))
tables.read(Folder(Path(sys.argv[1])), "tables")
print(len(os.listdir("/proc/self/task")) - before)
"""


def test_tables_come_back_and_leave_no_thread(tmp_path: Path) -> None:
    table = pd.DataFrame({"group": ["a", None], "reynolds": [1.5e-3, 2e-3], "why": ["low", "high"]})
    folder = Folder(tmp_path)
    with folder.renewed():
        tables.write({"single_grain": table}, folder, "tables")
    pd.testing.assert_frame_equal(tables.read(folder, "tables")["single_grain"], table)
    # a thread of Arrow's that is alive at exit ends the process by SIGABRT, now and then
    command = [sys.executable, "-c", READ, str(tmp_path)]
    found = subprocess.run(command, capture_output=True, text=True, check=True)
    assert int(found.stdout) == 0
