#!/usr/bin/env bash
# A PLY reader that takes coordinates by their place and not by their name: two points become one- or two-dimensional.
#
# Versions: meshio 5.3.5 (PyPI, with numpy 2.2.6).
# Seen: the PLY header names its properties, so their order is free. meshio looks for x in the first column, y in the
# second and z in the third, and leaves out what it does not find there, without an error or a warning:
#   z y x            points of one coordinate: [[2], [5]] for (1, 2, 3) and (4, 5, 6)
#   x y intensity z  points of two coordinates: [[1, 2], [4, 5]], and z among the point data
#   intensity x y z  ValueError: need at least one array to concatenate
# Rule: find x, y and z by name, and write them first, in this order, as some readers know no other.
#
# Needs python3 with venv and pip. Fails where the behaviour changes.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"

python3 -m venv venv
venv/bin/pip install -q --disable-pip-version-check meshio==5.3.5 numpy==2.2.6
cat > read.py <<'PY'
import meshio


def read(names, rows):
    with open("cloud.ply", "w") as file:
        file.write("ply\nformat ascii 1.0\nelement vertex %d\n" % len(rows))
        file.writelines("property float %s\n" % name for name in names)
        file.write("end_header\n")
        file.writelines(" ".join(map(str, row)) + "\n" for row in rows)
    try:
        cloud = meshio.read("cloud.ply")
    except ValueError as error:
        return str(error)
    return cloud.points.tolist(), sorted(cloud.point_data)


print(read(["x", "y", "z"], [(1, 2, 3), (4, 5, 6)]))
print(read(["z", "y", "x"], [(3, 2, 1), (6, 5, 4)]))
print(read(["x", "y", "intensity", "z"], [(1, 2, 9, 3), (4, 5, 8, 6)]))
print(read(["intensity", "x", "y", "z"], [(9, 1, 2, 3), (8, 4, 5, 6)]))
PY
venv/bin/python read.py | tee seen
cat > expected <<'TXT'
([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]], [])
([[2.0], [5.0]], ['x', 'y'])
([[1.0, 2.0], [4.0, 5.0]], ['intensity', 'z'])
need at least one array to concatenate
TXT
diff expected seen
