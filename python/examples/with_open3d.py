"""Open3D reads, thins and shows; conicoid finds the surfaces: python examples/with_open3d.py [CLOUD]

Without the name of a cloud it makes one. It writes surfaces.ply, which Open3D and others show in the colours of the
surfaces; `open3d.visualization.draw_geometries([coloured])` shows them at once where there is a display.
"""

from __future__ import annotations

import sys

import numpy as np
import open3d

import conicoid


def scan() -> open3d.geometry.PointCloud:
    random = np.random.default_rng(0)
    turn = random.uniform(0, 2 * np.pi, 20_000)
    pipe = np.column_stack([8 * np.cos(turn), 8 * np.sin(turn), random.uniform(0, 25, 20_000)])
    floor = np.column_stack([random.uniform(-30, 30, (20_000, 2)), np.zeros(20_000)])
    points = np.vstack([pipe, floor]) + 0.01 * random.standard_normal((40_000, 3))
    return open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points))


cloud = open3d.io.read_point_cloud(sys.argv[1]) if len(sys.argv) > 1 else scan()
# choosing points keeps their places; a voxel's mean would blur edges
cloud = cloud.uniform_down_sample(2)
result = conicoid.segment(cloud)
print(result)
for region, piece in zip(result.regions, result.to_open3d(split=True)):
    print(region.id, region.type, len(piece.points), piece.get_axis_aligned_bounding_box().get_extent())
coloured = result.to_open3d()
open3d.io.write_point_cloud("surfaces.ply", coloured)
