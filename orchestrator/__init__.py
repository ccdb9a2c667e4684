"""When does a sediment grain, or a whole bedform of grains, start to move?

A study file goes in; OpenFOAM and LIGGGHTS cases, tables, figures and a page come out.
"""

import os
import re

# of builds; but libraries read it when they are imported, and fail where it is no time
if not re.fullmatch("[0-9]{1,11}", os.environ.get("SOURCE_DATE_EPOCH", "0")):
    del os.environ["SOURCE_DATE_EPOCH"]

__version__ = "0.1.0"
