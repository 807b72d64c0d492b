"""PDAL reads and filters; conicoid finds the surfaces: python examples/with_pdal.py CLOUD.laz

Not run by the tests: PDAL's package for Python is built against an installed PDAL.
"""

from __future__ import annotations

import sys

import numpy as np
import pdal

import conicoid

pipeline = pdal.Pipeline([pdal.Reader(sys.argv[1])]) | pdal.Filter.outlier()
pipeline.execute()
table = pipeline.arrays[0]
result = conicoid.segment(np.column_stack([table["X"], table["Y"], table["Z"]]))
print(result)
for region in result.regions:
    print(region.id, region.type, np.unique(table["Classification"][result.labels == region.id]))
