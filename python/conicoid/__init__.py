"""conicoid finds planes, cylinders, cones, spheres, ellipsoids and tori in 3D point clouds.

`segment` does so in this process, `Client` by a service; both give a `Segmentation`. `fit` fits one feature to all
points. `read` reads the usual files.
"""

from __future__ import annotations

from importlib.metadata import version as _version

from . import records
from .client import Client, Job
from .errors import (
    Cancelled,
    CloudError,
    ConnectionFailed,
    DeadlineExceeded,
    Error,
    JobFailed,
    ParameterError,
    ServiceError,
    UnknownParameterError,
)
from .local import fit, load, segment
from .parameters import parameters
from .points import Cloud, from_pointcloud2, read
from .record import Record
from .records import Region
from .segmentation import Segmentation

__version__ = _version("conicoid")

__all__ = [
    "Cancelled",
    "Client",
    "Cloud",
    "CloudError",
    "ConnectionFailed",
    "DeadlineExceeded",
    "Error",
    "Job",
    "JobFailed",
    "ParameterError",
    "Record",
    "Region",
    "Segmentation",
    "ServiceError",
    "UnknownParameterError",
    "fit",
    "from_pointcloud2",
    "load",
    "parameters",
    "read",
    "records",
    "segment",
]
