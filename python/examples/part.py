"""From points to a table, a picture and a STEP file: python examples/part.py

Makes the scan of a small part, a plate with a boss and a ball, finds its surfaces and writes part.step, part.html and
part.png beside the place it is run in.
"""

from __future__ import annotations

import numpy as np

import conicoid

# %% A scan: 15 000 points with 0.01 mm of noise, some of them missing
random = np.random.default_rng(0)
turn = random.uniform(0, 2 * np.pi, 5000)
boss = np.column_stack([8 * np.cos(turn), 8 * np.sin(turn), random.uniform(0, 25, 5000)])
plate = np.column_stack([random.uniform(-30, 30, (6000, 2)), np.zeros(6000)])
normal = random.standard_normal((4000, 3))
ball = 6 * normal / np.linalg.norm(normal, axis=1)[:, None] + [20, 20, 14]
points = np.vstack([plate, boss, ball]) + 0.01 * random.standard_normal((15000, 3))
points[::500] = np.nan

# %% The surfaces in it
result = conicoid.segment(points, progress=lambda stage, fraction: print(f"{fraction:4.0%} {stage}"))
print(result)
for region in result.regions:
    print(region.id, region.type, region.point_count, region.surface)

# %% A dimension with its standard deviation
for region in result.regions:
    if isinstance(region.surface, conicoid.records.Cylinder) and region.uncertainty:
        print(f"the boss has a diameter of {region.diameter:.4f} +- {region.uncertainty.diameter:.4f} mm")

# %% What holds between them
for relation in result.relations:
    print(relation.kind, relation.regions)

# %% Points of one region, and how far they lie from it
first = result.regions[0]
print(result.points_of(first).mean(axis=0), np.nanmax(np.abs(result.deviations[result.labels == first.id])))

# %% A table and a picture
print(result.to_pandas()[["type", "point_count", "rms", "radius"]])
result.plot(s=2).figure.savefig("part.png")  # type: ignore[union-attr]

# %% Files for CAD and for people
result.save("part.step")
result.save("part.html")
