"""The objects of an answer, as the contract of the service describes them.

Made by tools/records.py; not to be changed by hand. Lengths are in the input's unit, angles in radians.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar, Literal, TypedDict, Union

import numpy as np
import numpy.typing as npt

from .record import Record

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

FloatArray = npt.NDArray[np.float64]

Continuity = Literal["G0", "G1"]

FeatureType = Literal["plane", "sphere", "cylinder", "cone", "elliptic_cylinder", "ellipsoid", "torus", "circle", "line"]

HintAction = Literal["surface", "merge", "split", "crop"]

JobState = Literal["queued", "running", "succeeded", "failed", "cancelled"]

LengthUnit = Literal["um", "mm", "cm", "m", "km", "in", "ft", "us_ft"]

MeasureKind = Literal["distance", "angle"]

MeshPoints = Literal["vertices", "samples"]

Method = Literal["distance", "rcond"]

Outcome = Literal["applied", "contradicted", "not_found"]

RelationKind = Literal["parallel", "perpendicular", "coaxial", "coplanar", "concentric", "equal_radius", "equal_major_radius", "equal_angle", "equal_semi_axes", "tangent", "symmetric", "circle_pattern", "grid_pattern"]

SamplingKind = Literal["scattered", "scan_lines", "grid", "lattice"]

Scale = Literal["a10", "unit"]

Side = Literal["hole", "boss", "unknown"]

SurfaceType = Literal["plane", "sphere", "cylinder", "elliptic_cylinder", "cone", "ellipsoid", "torus", "elliptic_paraboloid", "hyperbolic_paraboloid", "hyperboloid_one_sheet", "hyperboloid_two_sheets", "parabolic_cylinder", "hyperbolic_cylinder", "elliptic_cone"]

Verdict = Literal["conform", "not_conform", "undecided"]

class Certificate(Record):
    """The proof that no feature nearby is better: at the contacts the bound is reached, beyond it lies no point,
    and the derivatives of the distances at the contacts, each times its side and its multiplier, add up to
    zero. The multipliers are not negative and add up to 1.
    """
    _fields: ClassVar[dict[str, tuple[str, ...]]] = {
        "bound": (),
        "contacts": ("Contact",),
        "stationarity": (),
    }

    _lists: ClassVar[frozenset[str]] = frozenset(("contacts",))

    if TYPE_CHECKING:

        bound: float
        """The bound: half the width of a minimum zone; of a line, and of circumscribed and inscribed features, the
        radius.
        """

        contacts: list[Contact]
        """The points that hold the feature."""

        stationarity: float
        """Length of the sum of the derivatives, for unit points: zero but for rounding."""

class Characteristic(Record):
    """A toleranced characteristic."""
    _fields: ClassVar[dict[str, tuple[str, ...]]] = {
        "deviation": (),
        "expanded": (),
        "lower_limit": (),
        "measured": (),
        "name": (),
        "nominal": (),
        "undecided": (),
        "upper_limit": (),
        "verdict": (),
    }

    if TYPE_CHECKING:

        deviation: float | None
        """The measured value less the nominal one."""

        expanded: float | None
        """Its expanded uncertainty; of a form error twice what the noise of no point goes beyond, with `k` times
        `type_b` in quadrature. Null where there are no more points than determine the feature.
        """

        lower_limit: float | None
        """The smallest value allowed; null where there is none."""

        measured: float | None
        """The measured value: of the fitted feature; of a form error that of the minimum zone, or without one that of
        least squares. Null where the points do not tell it.
        """

        name: str
        """`diameter`, `full_angle`, `tube_diameter`, or the name of the form error."""

        nominal: float | None
        """The nominal value; null for a form error."""

        undecided: str | None
        """Why the verdict is open; absent where it is not."""

        upper_limit: float | None
        """The largest value allowed; null where there is none."""

        verdict: Verdict
        """The verdict by the decision rule of ISO 14253-1."""

class Circle(Record):
    """A circle in space."""
    _fields: ClassVar[dict[str, tuple[str, ...]]] = {
        "center": (),
        "normal": (),
        "radius": (),
    }

    _lists: ClassVar[frozenset[str]] = frozenset(("center", "normal"))

    if TYPE_CHECKING:

        center: FloatArray
        """Centre."""

        normal: FloatArray
        """Unit normal of its plane; which of the two ways it points means nothing."""

        radius: float
        """Radius > 0."""

class Cone(Record):
    """The right circular cone; points of it lie on the side of `axis_direction` from the apex."""
    _fields: ClassVar[dict[str, tuple[str, ...]]] = {
        "apex": (),
        "axis_direction": (),
        "half_angle": (),
        "type": (),
    }

    _lists: ClassVar[frozenset[str]] = frozenset(("apex", "axis_direction"))

    if TYPE_CHECKING:

        apex: FloatArray
        """The apex."""

        axis_direction: FloatArray
        """Unit direction from the apex into the cone."""

        half_angle: float
        """Angle between the axis and the surface, in radians, in (0, pi/2)."""

        type: Literal["cone"]
        """Which surface it is"""

class Contact(Record):
    """A point that holds a feature."""
    _fields: ClassVar[dict[str, tuple[str, ...]]] = {
        "multiplier": (),
        "point": (),
        "side": (),
    }

    if TYPE_CHECKING:

        multiplier: float
        """Its multiplier."""

        point: int
        """Its place in the input, from 0 on."""

        side: str
        """`outside` where it lies on the outer side of the zone or holds a circumscribed feature, else `inside`."""

class Convergence(Record):
    """How a fit ended."""
    _fields: ClassVar[dict[str, tuple[str, ...]]] = {
        "converged": (),
        "last_step": (),
        "steps": (),
    }

    if TYPE_CHECKING:

        converged: bool
        """Whether the last step was as short as rounding."""

        last_step: float
        """Length of the last step, in units of the points' size."""

        steps: int
        """Steps of the last descent."""

class Counters(Record):
    """How much work the method did."""
    _fields: ClassVar[dict[str, tuple[str, ...]]] = {
        "extraction_cycles": (),
        "failed_trials": (),
        "merges": (),
        "strategies": (),
        "trials": (),
    }

    _lists: ClassVar[frozenset[str]] = frozenset(("extraction_cycles",))

    if TYPE_CHECKING:

        extraction_cycles: list[list[int]]
        """`rcond` only: points added in each extraction cycle, one list a region."""

        failed_trials: int
        """Seeds that led to no region."""

        merges: int
        """Regions joined to another."""

        strategies: list[int] | None
        """`rcond` only: how often each reseeding strategy went on, in the seed's order."""

        trials: int
        """Seeds tried."""

class Cylinder(Record):
    """The right circular cylinder about an axis."""
    _fields: ClassVar[dict[str, tuple[str, ...]]] = {
        "axis_direction": (),
        "axis_point": (),
        "radius": (),
        "type": (),
    }

    _lists: ClassVar[frozenset[str]] = frozenset(("axis_direction", "axis_point"))

    if TYPE_CHECKING:

        axis_direction: FloatArray
        """Unit direction of the axis; which of the two ways it points means nothing."""

        axis_point: FloatArray
        """A point of the axis."""

        radius: float
        """Radius > 0."""

        type: Literal["cylinder"]
        """Which surface it is"""

class Datum(Record):
    """One datum."""
    _fields: ClassVar[dict[str, tuple[str, ...]]] = {
        "features": (),
        "region": (),
        "turned": (),
    }

    _lists: ClassVar[frozenset[str]] = frozenset(("features",))

    if TYPE_CHECKING:

        features: list[str]
        """Its situation features: `plane`, `axis`, `point`."""

        region: int
        """The region."""

        turned: float | None
        """How far its direction is turned, in radians, to be square or parallel to those before; null where it has
        none or tells a direction itself.
        """

class DatumSystem(Record):
    """A datum system: where a part's own coordinate system lies."""
    _fields: ClassVar[dict[str, tuple[str, ...]]] = {
        "datums": ("Datum",),
        "free": (),
        "refused": (),
        "transform": (),
    }

    _lists: ClassVar[frozenset[str]] = frozenset(("datums", "free"))

    if TYPE_CHECKING:

        datums: list[Datum]
        """The datums, the primary one first."""

        free: list[str]
        """What they leave free, in words."""

        refused: str | None
        """Why there is no transform, and what to do."""

        transform: FloatArray | None
        """The rows of the matrix that gives a place in the datum system from one in the input, (x, y, z, 1) each: a
        turn and a shift, right-handed. Its z axis is the first direction that the datums tell, its x axis the next.
        Null where they leave anything free.
        """

class Determination(Record):
    """How well points determine a feature."""
    _fields: ClassVar[dict[str, tuple[str, ...]]] = {
        "condition": (),
        "weakest": (),
    }

    if TYPE_CHECKING:

        condition: float
        """Condition number: by how much more the best told combination of the degrees of freedom is told than the
        worst, angles in radians and lengths in units of the points' size.
        """

        weakest: str
        """The combination that the points tell least, in words."""

class Dimensions(Record):
    """Ends, lengths, diameters and outlines of a region, where its type has them. Lengths are in the input's unit,
    angles in radians. An end that a neighbour bounds lies where the two surfaces meet; one that is free lies
    beyond the last point by half of the largest gap between the points there. `uncertainty` holds the standard
    deviations of `ends` (along the axis), `length`, `arc_angle`, `diameter` and `diameters`.
    """
    _fields: ClassVar[dict[str, tuple[str, ...]]] = {
        "arc_angle": (),
        "area": (),
        "bounded_by": (),
        "diameter": (),
        "diameters": (),
        "end_radii": (),
        "ends": (),
        "full_angle": (),
        "length": (),
        "outline": (),
        "share_seen": (),
        "side": (),
        "size": (),
        "size_directions": (),
        "swept_angle": (),
    }

    if TYPE_CHECKING:

        arc_angle: float | None
        """Torus: the angle about its axis between its ends; 2 pi where the ring closes."""

        area: float | None
        """Plane: area within `outline`."""

        bounded_by: list[int | None] | None
        """The neighbour that bounds each end; null where the end is free."""

        diameter: float | None
        """Of a sphere, a cylinder, or a torus' tube."""

        diameters: FloatArray | None
        """Elliptic cylinder: two; ellipsoid: three; the largest first."""

        end_radii: FloatArray | None
        """Cone: the radius at each of `ends`."""

        ends: FloatArray | None
        """Cylinder, elliptic cylinder, cone: the two end points on the axis, in the direction of `axis_direction`.
        Torus: those on the tube's middle line, counter-clockwise about `axis_direction`; absent where the ring
        closes.
        """

        full_angle: float | None
        """Cone: twice its half angle."""

        length: float | None
        """Distance between the ends along the axis; of a torus along the tube's middle line."""

        outline: FloatArray | None
        """Plane: closed polygons in space around the points, the last corner joined to the first: outer ones counter-
        clockwise about `normal`, those of holes clockwise, the largest first. They follow the edge to about a
        spacing of the points.
        """

        share_seen: float | None
        """Sphere, ellipsoid: share of the whole surface on which there are points, 0 to 1."""

        side: Side | None
        """On which side of a curved face the material is, where the cloud is that of a body seen from outside."""

        size: FloatArray | None
        """Plane: sides of the smallest rectangle around `outline`, the longer first."""

        size_directions: FloatArray | None
        """Plane: unit directions of these sides."""

        swept_angle: float | None
        """The smallest angle about the axis (of a torus: about the tube's middle line) within which all points lie; 2
        pi where they go all round.
        """

class Document(Record):
    """The result of a segmentation, as it is told."""
    _fields: ClassVar[dict[str, tuple[str, ...]]] = {
        "build": (),
        "conicoid": (),
        "counters": ("Counters",),
        "datum_system": ("DatumSystem",),
        "face_labels": (),
        "fits": ("RegionFit",),
        "hints": ("HintOutcome",),
        "input": ("Input",),
        "labels": (),
        "measures": ("Measure",),
        "parameters": ("Parameters",),
        "regions": ("Region",),
        "relation_scatter": (),
        "relations": ("Relation",),
        "sampling": ("Sampling",),
        "snapping": ("Snapping",),
        "timing": ("Timing",),
        "unassigned": ("UnassignedPoints",),
        "warnings": ("Warning",),
    }

    _lists: ClassVar[frozenset[str]] = frozenset(("fits", "hints", "measures", "regions", "relations", "warnings"))

    if TYPE_CHECKING:

        build: str
        """Which sources it was built of: a digest of them. Absent from results that earlier versions kept."""

        conicoid: str
        """Version of the program that made it."""

        counters: Counters
        """How much work the method did."""

        datum_system: DatumSystem | None
        """The coordinate system of the datums asked for; with `datums` alone."""

        face_labels: list[int] | None
        """One label for each face of a mesh that was sampled, in the file's order: that of most of its samples; -1 =
        unassigned, or without an area. Absent for other clouds, and with `labels=none`.
        """

        fits: list[RegionFit]
        """The feature of each region by the association asked for; with `association` alone."""

        hints: list[HintOutcome]
        """What became of each hint, in their order; absent where none was given."""

        input: Input
        """What the input was."""

        labels: list[int] | None
        """One label for each input point, in input order, or for each sample of a mesh; -1 = unassigned. Absent with
        `labels=none`.
        """

        measures: list[Measure]
        """Distances of parallel surfaces from the next, and angles of touching ones."""

        parameters: Parameters
        """Every parameter as used, `tolerance` and `noise_sigma` resolved."""

        regions: list[Region]
        """The surfaces; a region's id is its place here. Their order means nothing, but is the same for the same cloud
        and parameters.
        """

        relation_scatter: float
        """By how much the surfaces stand off from where their relations would have them, beyond what the uncertainty
        of their measurement explains: how exactly the part was made, in the input's unit. It counts as part of
        every surface's uncertainty in `relations`, `measures` and `snapped`. 0 where the measurement explains all.
        """

        relations: list[Relation]
        """What holds between the surfaces: directions, axes and sizes that they have in common, smooth joints,
        patterns. Between the 400 largest at most, and those whose uncertainty is known.
        """

        sampling: Sampling | None
        """How the points lie beside each other. Absent under `rcond`."""

        snapping: Snapping | None
        """What it took to make all accepted relations hold exactly; with `snap` alone."""

        timing: Timing
        """How long the steps took: the one part that differs between two runs."""

        unassigned: UnassignedPoints
        """The points without a region, skipped ones included."""

        warnings: list[Warning]
        """What of the input limits the answer; absent where nothing does."""

class Ellipsoid(Record):
    """The ellipsoid about `center`."""
    _fields: ClassVar[dict[str, tuple[str, ...]]] = {
        "center": (),
        "semi_axes": (),
        "semi_axis_directions": (),
        "type": (),
    }

    _lists: ClassVar[frozenset[str]] = frozenset(("center", "semi_axes", "semi_axis_directions"))

    if TYPE_CHECKING:

        center: FloatArray
        """Centre."""

        semi_axes: FloatArray
        """Semi-axes, the largest first."""

        semi_axis_directions: FloatArray
        """Unit directions of the semi-axes, right-handed; their signs mean nothing else."""

        type: Literal["ellipsoid"]
        """Which surface it is"""

class EllipticCylinder(Record):
    """The cylinder over an ellipse."""
    _fields: ClassVar[dict[str, tuple[str, ...]]] = {
        "axis_direction": (),
        "axis_point": (),
        "semi_axes": (),
        "semi_axis_directions": (),
        "type": (),
    }

    _lists: ClassVar[frozenset[str]] = frozenset(("axis_direction", "axis_point", "semi_axes", "semi_axis_directions"))

    if TYPE_CHECKING:

        axis_direction: FloatArray
        """Unit direction of the axis; which of the two ways it points means nothing."""

        axis_point: FloatArray
        """A point of the axis."""

        semi_axes: FloatArray
        """Semi-axes of the section, the larger first."""

        semi_axis_directions: FloatArray
        """Unit directions of the semi-axes, right-handed with the axis; their signs mean nothing else."""

        type: Literal["elliptic_cylinder"]
        """Which surface it is"""

class Evidence(Record):
    """How sure the choice of the type is."""
    _fields: ClassVar[dict[str, tuple[str, ...]]] = {
        "delta_bic": (),
        "runner_up": (),
    }

    if TYPE_CHECKING:

        delta_bic: float
        """How much larger its Bayesian information criterion is (natural units)."""

        runner_up: SurfaceType
        """The next best type."""

class Extent(Record):
    """Where a region lies."""
    _fields: ClassVar[dict[str, tuple[str, ...]]] = {
        "max": (),
        "min": (),
    }

    _lists: ClassVar[frozenset[str]] = frozenset(("max", "min"))

    if TYPE_CHECKING:

        max: FloatArray
        """Largest coordinates of its points."""

        min: FloatArray
        """Smallest coordinates of its points."""

class FeatureUncertainty(Record):
    """How exactly a feature is known."""
    _fields: ClassVar[dict[str, tuple[str, ...]]] = {
        "covariance": (),
        "covariance_of": (),
        "degrees_of_freedom": (),
        "k": (),
        "leaves_out": (),
        "n_eff": (),
        "parameters": ("ParameterUncertainty",),
        "s": (),
    }

    _lists: ClassVar[frozenset[str]] = frozenset(("covariance", "covariance_of", "leaves_out", "parameters"))

    if TYPE_CHECKING:

        covariance: FloatArray
        """Covariance of all their components from the scatter of the points alone, without the type B input. Empty for
        associations other than `gaussian`: how their few contacts may lie has none.
        """

        covariance_of: list[str]
        """The parameters whose components the rows of `covariance` are, in their order."""

        degrees_of_freedom: float
        """Effective degrees of freedom."""

        k: float
        """Factor of the expanded uncertainties: Student's t for the coverage and the degrees of freedom. For
        associations other than `gaussian` the expanded ones are bounds, and the standard ones these over it.
        """

        leaves_out: list[str]
        """What the uncertainties leave out."""

        n_eff: float
        """How many independent points tell as much as these do: less than there are where the distances of neighbours
        are alike.
        """

        parameters: list[ParameterUncertainty]
        """The parameters that the points tell."""

        s: float
        """Standard deviation of the distances: the root of their sum of squares over their number less the degrees of
        freedom. For associations other than `gaussian` that of the noise about the least-squares feature, which may
        be told from neighbours.
        """

class Fit(Record):
    """Distances of a region's points from its surface, in the input's unit."""
    _fields: ClassVar[dict[str, tuple[str, ...]]] = {
        "max": (),
        "noise": (),
        "rejected": (),
        "rms": (),
        "used": (),
    }

    if TYPE_CHECKING:

        max: float
        """Largest."""

        noise: float
        """The noise of this region's points: 1.4826 times the median distance, which a few outliers don't change."""

        rejected: int
        """Points of the region that the final fit left out."""

        rms: float
        """Root mean square."""

        used: int
        """Points the final fit used."""

class FitDocument(Record):
    """The result of a fit, as it is told."""
    _fields: ClassVar[dict[str, tuple[str, ...]]] = {
        "build": (),
        "certificate": ("Certificate",),
        "characteristics": ("Characteristic",),
        "conicoid": (),
        "convergence": ("Convergence",),
        "determination": ("Determination",),
        "form": ("Form",),
        "input": ("Input",),
        "local_origin": (),
        "local_surface": ("Circle", "Line", "Plane", "Sphere", "Cylinder", "EllipticCylinder", "Cone", "Ellipsoid", "Torus"),
        "not_identifiable": (),
        "others": ("Circle", "Line", "Plane", "Sphere", "Cylinder", "EllipticCylinder", "Cone", "Ellipsoid", "Torus"),
        "parameters": ("FitParameters",),
        "passed": ("PassedThrough",),
        "rejected": (),
        "residuals": ("Residuals",),
        "surface": ("Circle", "Line", "Plane", "Sphere", "Cylinder", "EllipticCylinder", "Cone", "Ellipsoid", "Torus"),
        "type": (),
        "uncertainty": ("FeatureUncertainty",),
        "used": (),
    }

    _lists: ClassVar[frozenset[str]] = frozenset(("characteristics", "local_origin", "not_identifiable", "others", "rejected"))

    if TYPE_CHECKING:

        build: str
        """Which sources it was built of: a digest of them. Absent from results that earlier versions kept."""

        certificate: Certificate | None
        """The proof of an association that is none of least squares; absent with `gaussian`."""

        characteristics: list[Characteristic]
        """What tolerances were given for, each with its verdict."""

        conicoid: str
        """Version of the program that made it."""

        convergence: Convergence
        """How the fit ended."""

        determination: Determination
        """How well the points determine the feature."""

        form: Form
        """The form error."""

        input: Input
        """What the input was."""

        local_origin: FloatArray
        """A place near the points."""

        local_surface: Element | None
        """The feature with its places relative to `local_origin`: far from the input's origin these have digits that
        those of `surface` have no room for.
        """

        not_identifiable: list[str]
        """Parameters that the points do not tell: sizes and angles less than three standard uncertainties from zero,
        directions known to no better than a third of a radian. They are told nowhere in the result.
        """

        others: list[Element]
        """Other features of the type that fit the points as well; they are as good an answer."""

        parameters: FitParameters
        """Every parameter as used."""

        passed: PassedThrough
        """What was passed through."""

        rejected: list[int]
        """Points that the outlier rule left out: their places in the input, from 0 on."""

        residuals: Residuals
        """Distances of the points used."""

        surface: Element | None
        """The feature in the input's coordinates; its point of axis, line or plane is the one beside the mean of the
        points used. Null where `not_identifiable` names a parameter.
        """

        type: FeatureType
        """The feature's type."""

        uncertainty: FeatureUncertainty | None
        """How exactly the parameters are known; null where there are no more points than determine the feature."""

        used: int
        """Points used."""

class FitForm(Record):
    """A cloud and what to do with it"""
    _fields: ClassVar[dict[str, tuple[str, ...]]] = {
        "association": (),
        "axis": (),
        "cloud": (),
        "columns": (),
        "coverage": (),
        "deadline": (),
        "form_tolerance": (),
        "format": (),
        "half_angle": (),
        "instrument": (),
        "lower": (),
        "name": (),
        "nominal": (),
        "operator": (),
        "outliers": (),
        "parameters": ("FitFormParameters",),
        "part": (),
        "radius": (),
        "residuals": (),
        "serial": (),
        "temperature": (),
        "time": (),
        "type": (),
        "type_b": (),
        "unit": (),
        "upper": (),
    }

    _lists: ClassVar[frozenset[str]] = frozenset(("axis", "columns"))

    if TYPE_CHECKING:

        association: Literal["gaussian", "minimum_zone", "minimum_circumscribed", "maximum_inscribed"]
        """gaussian: the least sum of squared distances of all points. minimum_zone: the least largest distance, of a
        line the thinnest cylinder that holds all points. minimum_circumscribed, maximum_inscribed: of a circle,
        sphere or cylinder, the smallest about all points and the largest among them. Default: gaussian.
        """

        axis: FloatArray
        """A fixed direction of the axis, of the line, or of the normal of a plane or circle."""

        cloud: str
        """The file's bytes; its name may tell the format"""

        columns: list[int]
        """Which columns of a text are x, y and z, counted from 1, such as 2,3,4 behind a running number (by their
        names, or the first three, when absent).
        """

        coverage: float
        """Probability that expanded uncertainties are made for. Default: 0.9545."""

        deadline: float
        """Longest time the work may take (the service's own limit when absent). Unit: seconds."""

        form_tolerance: float
        """Largest form error allowed. Unit: length."""

        format: Literal["ply", "xyz", "ptx", "pcd", "las", "e57", "stl", "obj", "off"]
        """The cloud's format (from its media type, file name or bytes when absent); other usual endings, such as csv,
        txt and laz, name it too.
        """

        half_angle: float
        """A fixed half angle of a cone. Unit: radians."""

        instrument: str
        """Passed through: what was measured with."""

        lower: float
        """Lower limit deviation from nominal, mostly below 0 (no lower limit when absent). Unit: length."""

        name: str
        """What the cloud is called in its report, such as the name of its file."""

        nominal: float
        """Nominal diameter of a circle, sphere, cylinder or of the tube of a torus; of a cone its full angle in
        radians. Unit: length.
        """

        operator: str
        """Passed through: who measured."""

        outliers: float
        """Points further off than this many standard deviations are left out, again and again until none is (none is
        left out when absent). Unit: deviations.
        """

        parameters: FitFormParameters
        """All parameters in one; each has one value, here or in the part of its name"""

        part: str
        """Passed through: the part."""

        radius: float
        """A fixed radius: of a sphere, cylinder or circle. Unit: length."""

        residuals: bool
        """Whether the answer holds each point's signed distance. Default: false."""

        serial: str
        """Passed through: its serial number."""

        temperature: str
        """Passed through: the temperature, with its unit."""

        time: str
        """Passed through: when it was measured."""

        type: Literal["auto", "plane", "sphere", "cylinder", "cone", "elliptic_cylinder", "ellipsoid", "torus", "circle", "line"]
        """The type of the feature; auto: the one that tells where the points lie in the fewest words. Default: auto."""

        type_b: float
        """Standard uncertainty of what all points have in common, such as the instrument's scale or probe, from
        elsewhere: added in quadrature to the uncertainty of each length, and over the points' size to that of each
        angle. Unit: length.
        """

        unit: Literal["um", "mm", "cm", "m", "km", "in", "ft", "us_ft"]
        """The unit of the cloud's lengths (the one that the file states when absent: E57, LAS with a coordinate
        system, text with names such as 'x [mm]'). It is told in every answer and stated in STEP; nothing is
        converted.
        """

        upper: float
        """Upper limit deviation from nominal (no upper limit when absent). Unit: length."""

class FitFormParameters(Record):
    """The parameters of a fit; each absent one takes its default"""
    _fields: ClassVar[dict[str, tuple[str, ...]]] = {
        "association": (),
        "axis": (),
        "columns": (),
        "coverage": (),
        "deadline": (),
        "form_tolerance": (),
        "format": (),
        "half_angle": (),
        "instrument": (),
        "lower": (),
        "name": (),
        "nominal": (),
        "operator": (),
        "outliers": (),
        "part": (),
        "radius": (),
        "residuals": (),
        "serial": (),
        "temperature": (),
        "time": (),
        "type": (),
        "type_b": (),
        "unit": (),
        "upper": (),
    }

    _lists: ClassVar[frozenset[str]] = frozenset(("axis", "columns"))

    if TYPE_CHECKING:

        association: Literal["gaussian", "minimum_zone", "minimum_circumscribed", "maximum_inscribed"]
        """gaussian: the least sum of squared distances of all points. minimum_zone: the least largest distance, of a
        line the thinnest cylinder that holds all points. minimum_circumscribed, maximum_inscribed: of a circle,
        sphere or cylinder, the smallest about all points and the largest among them. Default: gaussian.
        """

        axis: FloatArray
        """A fixed direction of the axis, of the line, or of the normal of a plane or circle."""

        columns: list[int]
        """Which columns of a text are x, y and z, counted from 1, such as 2,3,4 behind a running number (by their
        names, or the first three, when absent).
        """

        coverage: float
        """Probability that expanded uncertainties are made for. Default: 0.9545."""

        deadline: float
        """Longest time the work may take (the service's own limit when absent). Unit: seconds."""

        form_tolerance: float
        """Largest form error allowed. Unit: length."""

        format: Literal["ply", "xyz", "ptx", "pcd", "las", "e57", "stl", "obj", "off"]
        """The cloud's format (from its media type, file name or bytes when absent); other usual endings, such as csv,
        txt and laz, name it too.
        """

        half_angle: float
        """A fixed half angle of a cone. Unit: radians."""

        instrument: str
        """Passed through: what was measured with."""

        lower: float
        """Lower limit deviation from nominal, mostly below 0 (no lower limit when absent). Unit: length."""

        name: str
        """What the cloud is called in its report, such as the name of its file."""

        nominal: float
        """Nominal diameter of a circle, sphere, cylinder or of the tube of a torus; of a cone its full angle in
        radians. Unit: length.
        """

        operator: str
        """Passed through: who measured."""

        outliers: float
        """Points further off than this many standard deviations are left out, again and again until none is (none is
        left out when absent). Unit: deviations.
        """

        part: str
        """Passed through: the part."""

        radius: float
        """A fixed radius: of a sphere, cylinder or circle. Unit: length."""

        residuals: bool
        """Whether the answer holds each point's signed distance. Default: false."""

        serial: str
        """Passed through: its serial number."""

        temperature: str
        """Passed through: the temperature, with its unit."""

        time: str
        """Passed through: when it was measured."""

        type: Literal["auto", "plane", "sphere", "cylinder", "cone", "elliptic_cylinder", "ellipsoid", "torus", "circle", "line"]
        """The type of the feature; auto: the one that tells where the points lie in the fewest words. Default: auto."""

        type_b: float
        """Standard uncertainty of what all points have in common, such as the instrument's scale or probe, from
        elsewhere: added in quadrature to the uncertainty of each length, and over the points' size to that of each
        angle. Unit: length.
        """

        unit: Literal["um", "mm", "cm", "m", "km", "in", "ft", "us_ft"]
        """The unit of the cloud's lengths (the one that the file states when absent: E57, LAS with a coordinate
        system, text with names such as 'x [mm]'). It is told in every answer and stated in STEP; nothing is
        converted.
        """

        upper: float
        """Upper limit deviation from nominal (no upper limit when absent). Unit: length."""

class FitParameters(Record):
    """The parameters of a fit, as used."""
    _fields: ClassVar[dict[str, tuple[str, ...]]] = {
        "association": (),
        "axis": (),
        "coverage": (),
        "form_tolerance": (),
        "half_angle": (),
        "lower": (),
        "nominal": (),
        "outliers": (),
        "radius": (),
        "type": (),
        "type_b": (),
        "upper": (),
    }

    if TYPE_CHECKING:

        association: str
        """How the feature is associated with the points."""

        axis: FloatArray | None
        """A fixed direction."""

        coverage: float
        """Probability that expanded uncertainties are made for."""

        form_tolerance: float | None
        """Largest form error allowed."""

        half_angle: float | None
        """A fixed half angle."""

        lower: float | None
        """Lower limit deviation from `nominal`."""

        nominal: float | None
        """Nominal diameter or full angle."""

        outliers: float | None
        """Standard deviations beyond which points are left out."""

        radius: float | None
        """A fixed radius."""

        type: str
        """The type asked for, or `auto`."""

        type_b: float | None
        """Standard uncertainty of what all points have in common."""

        upper: float | None
        """Upper limit deviation from `nominal`."""

class Form(Record):
    """A form error."""
    _fields: ClassVar[dict[str, tuple[str, ...]]] = {
        "characteristic": (),
        "gaussian": (),
        "minimum_zone": (),
    }

    if TYPE_CHECKING:

        characteristic: str
        """Its name by ISO 1101 and ISO 12180, 12181, 12780 and 12781: flatness, roundness, straightness, cylindricity,
        sphericity; conicity; profile_of_surface of the other types.
        """

        gaussian: float
        """Peak to valley about the least-squares feature; of a line the diameter of the cylinder about it that holds
        all points, of a circle the range of the distances from its centre within its plane.
        """

        minimum_zone: float | None
        """The least peak to valley about any feature of the type: the form error of ISO 1101. Null where none is
        proven.
        """

class Hint(Record):
    """Something a person knows: a place, and what is to be done or is known there. A place is any of `at`,
    `extent` and `labels`, or several of them together. Lengths are in the input's unit, angles in radians.
    """
    _fields: ClassVar[dict[str, tuple[str, ...]]] = {
        "action": (),
        "at": (),
        "axis_direction": (),
        "axis_tolerance": (),
        "extent": ("Extent",),
        "labels": (),
        "radius": (),
        "radius_tolerance": (),
        "type": (),
    }

    _lists: ClassVar[frozenset[str]] = frozenset(("at", "labels"))

    if TYPE_CHECKING:

        action: HintAction
        """What is to be done there."""

        at: FloatArray
        """Points on the surface meant, each taken for the cloud's point nearest to it: the region that is found there
        is meant as a whole, or what lies around it where there is none. At most 64.
        """

        axis_direction: FloatArray | None
        """Direction of the axis or a plane's normal, whichever way it points. Of a plane, cylinder, elliptic cylinder,
        cone or torus.
        """

        axis_tolerance: float | None
        """By how much the direction may differ, in radians; 0 when absent."""

        extent: Extent | None
        """A box: the points in it are meant. `extent` of a region is one."""

        labels: list[int]
        """The points that carry one of these numbers in the file's own column `label`, as the PLY files of results
        have them. At most 64.
        """

        radius: float | None
        """Radius of a sphere or cylinder; one of these two is meant where the type is absent."""

        radius_tolerance: float | None
        """By how much the radius may differ; 0 when absent: it is exactly that."""

        type: SurfaceType | None
        """The surface's type: one of plane, sphere, cylinder, elliptic_cylinder, cone, ellipsoid and torus. Any of
        them when absent.
        """

class HintOutcome(Record):
    """What became of a hint."""
    _fields: ClassVar[dict[str, tuple[str, ...]]] = {
        "hint": (),
        "message": (),
        "misfit": (),
        "outcome": (),
        "regions": (),
        "scatter": (),
    }

    _lists: ClassVar[frozenset[str]] = frozenset(("regions",))

    if TYPE_CHECKING:

        hint: int
        """Its place in the list of hints."""

        message: str
        """The same in words, with what can be done about it."""

        misfit: float | None
        """By how many standard deviations the points deny a radius or direction that was told, beyond its tolerance;
        of several the largest. Absent where none was told.
        """

        outcome: Outcome
        """Whether the answer follows it."""

        regions: list[int]
        """The regions that it made or, where nothing came of it, that lie where it is about."""

        scatter: float | None
        """How far the place's points lie from the surface that was told, root mean square, in standard deviations of
        the noise: about 1 where it is theirs. Absent where no surface was told or fitted.
        """

class Input(Record):
    """What the input was."""
    _fields: ClassVar[dict[str, tuple[str, ...]]] = {
        "format": (),
        "mesh": ("MeshInput",),
        "points": (),
        "resolution": (),
        "sha256": (),
        "skipped": (),
        "thin": ("ThinInput",),
        "unit": (),
    }

    _lists: ClassVar[frozenset[str]] = frozenset(("resolution",))

    if TYPE_CHECKING:

        format: str
        """The format the file was read as."""

        mesh: MeshInput | None
        """The mesh, where the file is one."""

        points: int
        """Points in the file, skipped ones included; samples where a mesh was sampled."""

        resolution: FloatArray
        """The step in which the coordinates x, y and z come: that of their decimals, of single precision at their
        size, or of the file before a pose was applied. No surface is known better than its points are. 0 where
        there is none to be seen, and where it is that of any double.
        """

        sha256: str
        """SHA-256 of the file's bytes, in hexadecimal."""

        skipped: int
        """Points left out because a coordinate was not finite, or because they are holes: marked so in the file, or
        many at exactly 0, 0, 0.
        """

        thin: ThinInput | None
        """How the points were thinned; absent where all were used."""

        unit: LengthUnit | None
        """The unit of all lengths: the parameter `unit`, or else the one that the file states. Absent where neither
        does.
        """

class JobDocument(Record):
    """A job."""
    _fields: ClassVar[dict[str, tuple[str, ...]]] = {
        "created_ms": (),
        "finished_ms": (),
        "id": (),
        "problem": ("JobProblem",),
        "progress": ("JobProgress",),
        "started_ms": (),
        "state": (),
    }

    if TYPE_CHECKING:

        created_ms: int
        """When it was accepted, in milliseconds since 1970-01-01 UTC."""

        finished_ms: int | None
        """When it ended; absent before."""

        id: str
        """Its name."""

        problem: JobProblem | None
        """Why it failed; absent otherwise."""

        progress: JobProgress | None
        """How far it is; only while it runs."""

        started_ms: int | None
        """When it began to run; absent before."""

        state: JobState
        """Where it stands."""

class JobList(Record):
    """Some of the caller's jobs."""
    _fields: ClassVar[dict[str, tuple[str, ...]]] = {
        "jobs": ("JobDocument",),
        "next_page_token": (),
    }

    _lists: ClassVar[frozenset[str]] = frozenset(("jobs",))

    if TYPE_CHECKING:

        jobs: list[JobDocument]
        """The jobs, the newest first."""

        next_page_token: str
        """Asks for the page behind this one, as `page_token`; absent where there is none."""

class JobProblem(Record):
    """Why a job failed."""
    _fields: ClassVar[dict[str, tuple[str, ...]]] = {
        "code": (),
        "detail": (),
    }

    if TYPE_CHECKING:

        code: str
        """The stable code."""

        detail: str
        """What happened and what to do."""

class JobProgress(Record):
    """How far a job is."""
    _fields: ClassVar[dict[str, tuple[str, ...]]] = {
        "fraction": (),
        "stage": (),
    }

    if TYPE_CHECKING:

        fraction: float
        """How much of the whole work is done, 0 to 1."""

        stage: str
        """The stage of the method."""

class Line(Record):
    """A straight line."""
    _fields: ClassVar[dict[str, tuple[str, ...]]] = {
        "direction": (),
        "point": (),
    }

    _lists: ClassVar[frozenset[str]] = frozenset(("direction", "point"))

    if TYPE_CHECKING:

        direction: FloatArray
        """Unit direction; which of the two ways it points means nothing."""

        point: FloatArray
        """The point of the line beside the points' mean."""

class Measure(Record):
    """A distance or an angle between two regions."""
    _fields: ClassVar[dict[str, tuple[str, ...]]] = {
        "kind": (),
        "regions": (),
        "uncertainty": (),
        "value": (),
    }

    _lists: ClassVar[frozenset[str]] = frozenset(("regions",))

    if TYPE_CHECKING:

        kind: MeasureKind
        """What is measured."""

        regions: list[int]
        """The regions."""

        uncertainty: float
        """Its standard uncertainty."""

        value: float
        """The distance, in the input's unit, or the angle, in radians from 0 to pi/2."""

class MeshInput(Record):
    """A mesh, and what was taken of it."""
    _fields: ClassVar[dict[str, tuple[str, ...]]] = {
        "chord_error": (),
        "faces": (),
        "points": (),
        "spacing": (),
        "vertices": (),
    }

    if TYPE_CHECKING:

        chord_error: float | None
        """The largest distance found of the curved surfaces from the flat faces that stand for them, but for a few.
        Samples scatter by a fifth of it; of samples alone.
        """

        faces: int
        """Faces of the file."""

        points: MeshPoints
        """What the points are."""

        spacing: float | None
        """Distance of a sample from the next, were they on squares; of samples alone."""

        vertices: int
        """Vertices of the file, those of a STL file each once."""

class Neighbour(Record):
    """A region that touches another."""
    _fields: ClassVar[dict[str, tuple[str, ...]]] = {
        "continuity": (),
        "region": (),
        "resolution": (),
    }

    if TYPE_CHECKING:

        continuity: Continuity
        """The class of the joint."""

        region: int
        """The other region's id."""

        resolution: float
        """How far from the true joint the boundary may lie, in the input's unit."""

class ParameterUncertainty(Record):
    """The uncertainty of one parameter."""
    _fields: ClassVar[dict[str, tuple[str, ...]]] = {
        "expanded": (),
        "name": (),
        "standard": (),
        "values": (),
    }

    _lists: ClassVar[frozenset[str]] = frozenset(("expanded", "standard", "values"))

    if TYPE_CHECKING:

        expanded: FloatArray
        """Expanded uncertainties: `k` times the standard ones."""

        name: str
        """The parameter's name, as in the surface."""

        standard: FloatArray
        """Standard uncertainty of each component; of each direction one, its angle's in radians."""

        values_: FloatArray
        """Its components."""

class Parameters(Record):
    """Every parameter of a segmentation. Lengths are in the input's unit, angles in radians. `PARAMETERS` holds
    each one's name, unit, range and meaning; all transports read that table.
    """
    _fields: ClassVar[dict[str, tuple[str, ...]]] = {
        "algebraic_threshold": (),
        "axis_direction": (),
        "axis_tolerance": (),
        "connectivity": (),
        "hints": ("Hint",),
        "max_failed_seeds": (),
        "max_radius": (),
        "max_regions": (),
        "merge": (),
        "method": (),
        "min_points": (),
        "min_radius": (),
        "noise_sigma": (),
        "rcond_threshold": (),
        "refine": (),
        "seed": (),
        "surfaces": (),
        "tolerance": (),
    }

    _lists: ClassVar[frozenset[str]] = frozenset(("hints", "surfaces"))

    if TYPE_CHECKING:

        algebraic_threshold: float
        """`rcond` only: largest algebraic residual |x.a| (a10 = 1) of an extracted point."""

        axis_direction: FloatArray | None
        """Direction the axes (or plane normals) must have."""

        axis_tolerance: float
        """Largest angle between an axis and `axis_direction`."""

        connectivity: float | None
        """Largest gap inside one piece of a surface: wider ones part it into regions; none does when absent."""

        hints: list[Hint]
        """What a person knows of places in the cloud. `rcond` takes those alone that crop."""

        max_failed_seeds: int
        """How many seeds in a row may fail before growth stops."""

        max_radius: float | None
        """Largest radius or semi-axis looked for."""

        max_regions: int
        """Largest number of regions reported."""

        merge: bool
        """Whether pieces of one surface are joined."""

        method: Method
        """Which policies to run with."""

        min_points: int
        """Smallest number of points a region may have."""

        min_radius: float | None
        """Smallest radius or semi-axis looked for."""

        noise_sigma: float | None
        """Standard deviation of the points' noise; estimated from the cloud when absent. No region is reported whose
        residuals' root mean square is above twice the value given, or above half the tolerance where one is given
        that allows more. What is below 5e-8 of the cloud's size, the rounding of single precision, counts as that.
        """

        rcond_threshold: float
        """`rcond` only: a point joins while rcond(S) stays below this. 1-norm, raw coordinates."""

        refine: bool
        """Whether boundaries and surfaces are refined at the end."""

        seed: int
        """Seed of the random generator."""

        surfaces: list[SurfaceType]
        """The types looked for."""

        tolerance: float | None
        """Largest distance of a point from its surface; four noise sigmas when absent. No region has a point beyond
        it.
        """

class PassedThrough(Record):
    """What the caller gave to stand in the result."""
    _fields: ClassVar[dict[str, tuple[str, ...]]] = {
        "instrument": (),
        "name": (),
        "operator": (),
        "part": (),
        "serial": (),
        "temperature": (),
        "time": (),
    }

    if TYPE_CHECKING:

        instrument: str | None
        """What was measured with."""

        name: str | None
        """What the cloud is called."""

        operator: str | None
        """Who measured."""

        part: str | None
        """The part."""

        serial: str | None
        """Its serial number."""

        temperature: str | None
        """The temperature."""

        time: str | None
        """When it was measured."""

class Plane(Record):
    """The plane through `point` with the unit vector `normal`."""
    _fields: ClassVar[dict[str, tuple[str, ...]]] = {
        "normal": (),
        "point": (),
        "type": (),
    }

    _lists: ClassVar[frozenset[str]] = frozenset(("normal", "point"))

    if TYPE_CHECKING:

        normal: FloatArray
        """Unit normal; which of the two ways it points means nothing."""

        point: FloatArray
        """A point of the plane."""

        type: Literal["plane"]
        """Which surface it is"""

class Region(Record):
    """One surface and its points."""
    _fields: ClassVar[dict[str, tuple[str, ...]]] = {
        "coefficients": (),
        "coefficients_error": (),
        "coefficients_scale": (),
        "evidence": ("Evidence",),
        "extent": ("Extent",),
        "fit": ("Fit",),
        "id": (),
        "local_coefficients": (),
        "local_origin": (),
        "neighbours": ("Neighbour",),
        "point_count": (),
        "snapped": ("Snapped",),
        "surface": ("Plane", "Sphere", "Cylinder", "EllipticCylinder", "Cone", "Ellipsoid", "Torus"),
        "type": (),
        "uncertainty": ("Uncertainty",),
        "arc_angle": (),
        "area": (),
        "bounded_by": (),
        "diameter": (),
        "diameters": (),
        "end_radii": (),
        "ends": (),
        "full_angle": (),
        "length": (),
        "outline": (),
        "share_seen": (),
        "side": (),
        "size": (),
        "size_directions": (),
        "swept_angle": (),
    }

    _lists: ClassVar[frozenset[str]] = frozenset(("local_origin", "neighbours"))

    if TYPE_CHECKING:

        coefficients: FloatArray | None
        """a1..a10 in the seed's order (1), about the file's origin. Far from it their terms cancel: where
        `coefficients_error` is not small against what matters, reckon with `local_coefficients`. null for a torus,
        which is no quadric; so are the other fields of the coefficients.
        """

        coefficients_error: float | None
        """How far off `coefficients` are as written, as a length: the largest difference, over the region's points,
        between the distance |Q| / |grad Q| by them and by `local_coefficients`, reckoned term by term in double
        precision. null where it is infinite or where the gradient vanishes at all points.
        """

        coefficients_scale: Scale | None
        """How the coefficients are scaled."""

        evidence: Evidence | None
        """Why this type."""

        extent: Extent | None
        """How far the region reaches."""

        fit: Fit
        """How well the points fit."""

        id: int
        """The label of its points."""

        local_coefficients: FloatArray | None
        """a1..a10 about `local_origin`: the surface with no digits lost, however far the cloud lies from the file's
        origin. Scaled so that the gradient's root mean square over the region's points is 1: the value at a point
        near the surface is about its distance from it. Of unit length where the gradient vanishes at all points.
        """

        local_origin: FloatArray
        """An origin near the region's points: the middle of its box, rounded to few decimal digits, which read back as
        the same number. A point x of the file is x - local_origin in the local equation.
        """

        neighbours: list[Neighbour]
        """The regions it touches."""

        point_count: int
        """How many points carry its label."""

        snapped: Snapped | None
        """The surface for which the accepted relations hold exactly; with `snap` alone. Its own where that is related
        to no other.
        """

        surface: Surface | None
        """The surface in engineering terms; absent for the quadrics that have none here."""

        type: SurfaceType
        """The surface's type, the simplest that the points do not speak against."""

        uncertainty: Uncertainty | None
        """How exactly the surface's parameters are known; absent where that is not known. In the form of
        [`Uncertainty`].
        """

        arc_angle: float | None
        """Torus: the angle about its axis between its ends; 2 pi where the ring closes."""

        area: float | None
        """Plane: area within `outline`."""

        bounded_by: list[int | None] | None
        """The neighbour that bounds each end; null where the end is free."""

        diameter: float | None
        """Of a sphere, a cylinder, or a torus' tube."""

        diameters: FloatArray | None
        """Elliptic cylinder: two; ellipsoid: three; the largest first."""

        end_radii: FloatArray | None
        """Cone: the radius at each of `ends`."""

        ends: FloatArray | None
        """Cylinder, elliptic cylinder, cone: the two end points on the axis, in the direction of `axis_direction`.
        Torus: those on the tube's middle line, counter-clockwise about `axis_direction`; absent where the ring
        closes.
        """

        full_angle: float | None
        """Cone: twice its half angle."""

        length: float | None
        """Distance between the ends along the axis; of a torus along the tube's middle line."""

        outline: FloatArray | None
        """Plane: closed polygons in space around the points, the last corner joined to the first: outer ones counter-
        clockwise about `normal`, those of holes clockwise, the largest first. They follow the edge to about a
        spacing of the points.
        """

        share_seen: float | None
        """Sphere, ellipsoid: share of the whole surface on which there are points, 0 to 1."""

        side: Side | None
        """On which side of a curved face the material is, where the cloud is that of a body seen from outside."""

        size: FloatArray | None
        """Plane: sides of the smallest rectangle around `outline`, the longer first."""

        size_directions: FloatArray | None
        """Plane: unit directions of these sides."""

        swept_angle: float | None
        """The smallest angle about the axis (of a torus: about the tube's middle line) within which all points lie; 2
        pi where they go all round.
        """

    @property
    def dimensions(self) -> Dimensions:
        """Those of its fields that are of `Dimensions`, by themselves."""
        return Dimensions({k: v for k, v in self._data.items() if k in Dimensions._fields})

class RegionFit(Record):
    """The feature of a region's points: what a fit to them alone gives, to the last bit."""
    _fields: ClassVar[dict[str, tuple[str, ...]]] = {
        "fit": ("FitDocument",),
        "refused": (),
        "region": (),
    }

    if TYPE_CHECKING:

        fit: FitDocument | None
        """The feature. Its `input` counts the region's points; its `rejected` and `certificate` name places in the
        whole input. Null where there is none.
        """

        refused: str | None
        """Why there is none."""

        region: int
        """The region."""

class Relation(Record):
    """Something that holds between surfaces of a result. Lengths are in the input's unit, angles in radians."""
    _fields: ClassVar[dict[str, tuple[str, ...]]] = {
        "accepted": (),
        "count": (),
        "counts": (),
        "deviation": (),
        "direction": (),
        "grid_directions": (),
        "kind": (),
        "log_odds": (),
        "p_value": (),
        "pitches": (),
        "point": (),
        "regions": (),
        "spacing": (),
        "to": (),
        "uncertainty": (),
        "value": (),
    }

    _lists: ClassVar[frozenset[str]] = frozenset(("regions", "to"))

    if TYPE_CHECKING:

        accepted: bool
        """Whether it is accepted: the deviation is compatible with it, and so much smaller than what chance brings
        about that the odds are above ten to one.
        """

        count: int | None
        """Circle pattern: how many places a full circle has. Of these `regions` may miss some."""

        counts: list[int] | None
        """Grid pattern: how many places in each direction; 1 in the second of a single row."""

        deviation: float
        """How far the surfaces as fitted are from it: the angle between directions, the distance of axes, planes or
        centres, the difference of radii or angles, the gap of a joint. Of several regions, the largest deviation,
        in standard uncertainties, of one from what the others tell.
        """

        direction: FloatArray | None
        """The direction that parallel surfaces have in common, of the common axis, across the mirror, or across a
        pattern.
        """

        grid_directions: FloatArray | None
        """Grid pattern: the unit directions."""

        kind: RelationKind
        """What it is."""

        log_odds: float
        """Natural logarithm of the odds that it holds exactly against that the deviation may be anything, after all
        that the other surfaces tell about how common such relations are here. Of several regions, the weakest.
        """

        p_value: float
        """Probability of deviations as large as those found, or larger, if the relation holds exactly."""

        pitches: FloatArray | None
        """Grid pattern: distance from one place to the next in each direction; 0 in the second of a single row."""

        point: FloatArray | None
        """A point of the common axis or plane or of the mirror; the common centre; the middle of a circle pattern, the
        first place of a grid pattern.
        """

        regions: list[int]
        """The regions that it holds between: among all of them, or, where `to` names others, between each of them and
        each of those.
        """

        spacing: float | None
        """Circle pattern: the angle from one place to the next."""

        to: list[int]
        """The regions on its other side; absent where there is none."""

        uncertainty: float
        """Standard uncertainty of `deviation`, from the covariances of the surfaces."""

        value: float | None
        """The common radius or half angle; the pitch radius of a circle pattern."""

class Residuals(Record):
    """Signed distances of the points used, positive outside; from a circle or a line their lengths."""
    _fields: ClassVar[dict[str, tuple[str, ...]]] = {
        "max": (),
        "min": (),
        "range": (),
        "rms": (),
        "standard_deviation": (),
        "values": (),
    }

    if TYPE_CHECKING:

        max: float
        """The largest."""

        min: float
        """The smallest."""

        range: float
        """The largest less the smallest."""

        rms: float
        """Root mean square."""

        standard_deviation: float
        """Standard deviation about their mean."""

        values_: list[float | None] | None
        """That of each input point, in input order, also of points left out; null where a coordinate is not finite.
        With `residuals` alone.
        """

class Sampling(Record):
    """How a cloud was sampled."""
    _fields: ClassVar[dict[str, tuple[str, ...]]] = {
        "across": (),
        "along": (),
        "kind": (),
        "steps": (),
    }

    _lists: ClassVar[frozenset[str]] = frozenset(("steps",))

    if TYPE_CHECKING:

        across: float
        """Median distance from the nearest one about at right angles to that: to the next line. 0 where there is none."""

        along: float
        """Median distance of a point from the nearest one, in the input's unit: along a scan line where points lie on
        some. 0 where there are no two points.
        """

        kind: SamplingKind
        """How points lie beside each other."""

        steps: FloatArray
        """The step in which each coordinate comes (decimals, voxels, single precision at the size of the coordinates);
        0 where it comes in none.
        """

class SegmentationForm(Record):
    """A cloud and what to do with it"""
    _fields: ClassVar[dict[str, tuple[str, ...]]] = {
        "algebraic_threshold": (),
        "association": (),
        "axis_direction": (),
        "axis_tolerance": (),
        "cloud": (),
        "columns": (),
        "connectivity": (),
        "datums": (),
        "deadline": (),
        "format": (),
        "hints": ("Hint",),
        "labels": (),
        "max_failed_seeds": (),
        "max_radius": (),
        "max_regions": (),
        "merge": (),
        "mesh": (),
        "mesh_points": (),
        "mesh_spacing": (),
        "method": (),
        "min_points": (),
        "min_radius": (),
        "name": (),
        "noise_sigma": (),
        "parameters": ("SegmentationParameters",),
        "rcond_threshold": (),
        "refine": (),
        "seed": (),
        "skip_lines": (),
        "snap": (),
        "surfaces": (),
        "thin": (),
        "tolerance": (),
        "unit": (),
    }

    _lists: ClassVar[frozenset[str]] = frozenset(("axis_direction", "columns", "datums", "hints", "surfaces"))

    if TYPE_CHECKING:

        algebraic_threshold: float
        """rcond only: largest algebraic residual, with a10 = 1, of an extracted point. Default: 5e-5."""

        association: Literal["gaussian", "minimum_zone", "minimum_circumscribed", "maximum_inscribed"]
        """Fits one feature to all points of each region too, `fits`, by this association, as a fit of these points
        alone would (none is fitted when absent).
        """

        axis_direction: FloatArray
        """distance only: direction that axes and plane normals must have, as x,y,z."""

        axis_tolerance: float
        """distance only: largest angle between an axis and axis_direction. Unit: radians. Default: 0.05."""

        cloud: str
        """The file's bytes; its name may tell the format"""

        columns: list[int]
        """Which columns of a text are x, y and z, counted from 1, such as 2,3,4 behind a running number (by their
        names, or the first three, when absent).
        """

        connectivity: float
        """distance only: largest gap inside one piece of a surface: wider ones part it (none does when absent). Unit:
        length.
        """

        datums: list[int]
        """Makes a coordinate system of these regions, the primary datum first, after ISO 5459, `datum_system`, of
        their surfaces or, with association, of their fits. Ids of regions are the same for the same cloud and
        parameters (none is made when absent).
        """

        deadline: float
        """Longest time the work may take (the service's own limit when absent). Unit: seconds."""

        format: Literal["ply", "xyz", "ptx", "pcd", "las", "e57", "stl", "obj", "off"]
        """The cloud's format (from its media type, file name or bytes when absent); other usual endings, such as csv,
        txt and laz, name it too.
        """

        hints: list[Hint]
        """What you know of places in the cloud: a JSON list of objects, each with a place (at, extent or labels) and a
        type, radius or axis_direction there, or an action (merge, split, crop), such as [{'at': [[1, 2, 3]],
        'type': 'cylinder', 'radius': 10}]. What became of each stands in the answer's hints.
        """

        labels: Literal["inline", "none"]
        """Whether the answer holds one label a point. Default: inline."""

        max_failed_seeds: int
        """How many seed points in a row may fail before the search stops. Default: 50."""

        max_radius: float
        """distance only: largest radius or semi-axis looked for; at least min_radius. Unit: length."""

        max_regions: int
        """Largest number of regions reported; the largest ones stay. Default: 10000."""

        merge: bool
        """Join pieces of one surface into one region. Default: true."""

        mesh: Literal["auto", "vertices", "faces"]
        """What the points of a mesh (STL, OBJ, OFF, PLY with faces) are: its vertices, or points spread evenly over
        the surface that its faces stand for. auto: the faces where the vertices are the corners of large faces
        alone, as in CAD meshes, or else the vertices. Default: auto.
        """

        mesh_points: int
        """Most points on the faces of a mesh. Default: 100000."""

        mesh_spacing: float
        """Distance of the points on the faces of a mesh from each other (when absent so that nine in ten of its smooth
        pieces get 150 points or more, but 20 000 to mesh_points in all). Unit: length.
        """

        method: Literal["distance", "rcond"]
        """distance: every surface and boundary by orthogonal distance. rcond: the seed's growth on the scatter
        matrix's condition. A parameter that is one method's only is not looked at by the other. Default: distance.
        """

        min_points: int
        """Smallest number of points a region may have; below about 30 only clear surfaces are found. Unit: points.
        Default: 50.
        """

        min_radius: float
        """distance only: smallest radius or semi-axis looked for; at most max_radius. Unit: length."""

        name: str
        """What the cloud is called in its report, such as the name of its file."""

        noise_sigma: float
        """distance only: standard deviation of the points' noise (estimated from the cloud when absent). No region is
        reported whose residuals' root mean square is above twice the value given, or above half the tolerance where
        one is given that allows more. Unit: length.
        """

        parameters: SegmentationParameters
        """All parameters in one; each has one value, here or in the part of its name"""

        rcond_threshold: float
        """rcond only: a point joins while the 1-norm reciprocal condition number of the scatter matrix, in raw
        coordinates, stays below this. It depends on the unit and the origin. Default: 0.5e-19.
        """

        refine: bool
        """Refine boundaries and surfaces at the end. Default: true."""

        seed: int
        """Seed of the random generator; the same seed gives the same bytes, timing apart. Default: 0."""

        skip_lines: int
        """How many lines of a text to pass over before it begins, titles and protocols that carry no comment mark.
        Names of columns among them are not looked at. Default: 0.
        """

        snap: bool
        """Whether each region is given a second surface, `snapped`, for which all accepted relations hold exactly.
        Default: false.
        """

        surfaces: list[Literal["plane", "sphere", "cylinder", "elliptic_cylinder", "cone", "ellipsoid", "torus", "elliptic_paraboloid", "hyperbolic_paraboloid", "hyperboloid_one_sheet", "hyperboloid_two_sheets", "parabolic_cylinder", "hyperbolic_cylinder", "elliptic_cone"]]
        """distance only: the surface types looked for, each for itself: ellipsoid does not stand for sphere, nor
        elliptic_cylinder for cylinder. Default: plane, sphere, cylinder, elliptic_cylinder, cone, ellipsoid, torus.
        """

        thin: float
        """Thins the cloud as it is read: of points closer to each other than this one is kept, the surfaces are found
        by those kept, and every other point gets the label of the kept one nearest to it. For clouds larger than
        the memory (all points are used when absent). Unit: length.
        """

        tolerance: float
        """distance only: largest distance of a point from its surface (four noise sigmas when absent); no region has a
        point beyond it. Unit: length.
        """

        unit: Literal["um", "mm", "cm", "m", "km", "in", "ft", "us_ft"]
        """The unit of the cloud's lengths (the one that the file states when absent: E57, LAS with a coordinate
        system, text with names such as 'x [mm]'). It is told in every answer and stated in STEP; nothing is
        converted.
        """

class SegmentationParameters(Record):
    """The parameters of a segmentation; each absent one takes its default"""
    _fields: ClassVar[dict[str, tuple[str, ...]]] = {
        "algebraic_threshold": (),
        "association": (),
        "axis_direction": (),
        "axis_tolerance": (),
        "columns": (),
        "connectivity": (),
        "datums": (),
        "deadline": (),
        "format": (),
        "hints": ("Hint",),
        "labels": (),
        "max_failed_seeds": (),
        "max_radius": (),
        "max_regions": (),
        "merge": (),
        "mesh": (),
        "mesh_points": (),
        "mesh_spacing": (),
        "method": (),
        "min_points": (),
        "min_radius": (),
        "name": (),
        "noise_sigma": (),
        "rcond_threshold": (),
        "refine": (),
        "seed": (),
        "skip_lines": (),
        "snap": (),
        "surfaces": (),
        "thin": (),
        "tolerance": (),
        "unit": (),
    }

    _lists: ClassVar[frozenset[str]] = frozenset(("axis_direction", "columns", "datums", "hints", "surfaces"))

    if TYPE_CHECKING:

        algebraic_threshold: float
        """rcond only: largest algebraic residual, with a10 = 1, of an extracted point. Default: 5e-5."""

        association: Literal["gaussian", "minimum_zone", "minimum_circumscribed", "maximum_inscribed"]
        """Fits one feature to all points of each region too, `fits`, by this association, as a fit of these points
        alone would (none is fitted when absent).
        """

        axis_direction: FloatArray
        """distance only: direction that axes and plane normals must have, as x,y,z."""

        axis_tolerance: float
        """distance only: largest angle between an axis and axis_direction. Unit: radians. Default: 0.05."""

        columns: list[int]
        """Which columns of a text are x, y and z, counted from 1, such as 2,3,4 behind a running number (by their
        names, or the first three, when absent).
        """

        connectivity: float
        """distance only: largest gap inside one piece of a surface: wider ones part it (none does when absent). Unit:
        length.
        """

        datums: list[int]
        """Makes a coordinate system of these regions, the primary datum first, after ISO 5459, `datum_system`, of
        their surfaces or, with association, of their fits. Ids of regions are the same for the same cloud and
        parameters (none is made when absent).
        """

        deadline: float
        """Longest time the work may take (the service's own limit when absent). Unit: seconds."""

        format: Literal["ply", "xyz", "ptx", "pcd", "las", "e57", "stl", "obj", "off"]
        """The cloud's format (from its media type, file name or bytes when absent); other usual endings, such as csv,
        txt and laz, name it too.
        """

        hints: list[Hint]
        """What you know of places in the cloud: a JSON list of objects, each with a place (at, extent or labels) and a
        type, radius or axis_direction there, or an action (merge, split, crop), such as [{'at': [[1, 2, 3]],
        'type': 'cylinder', 'radius': 10}]. What became of each stands in the answer's hints.
        """

        labels: Literal["inline", "none"]
        """Whether the answer holds one label a point. Default: inline."""

        max_failed_seeds: int
        """How many seed points in a row may fail before the search stops. Default: 50."""

        max_radius: float
        """distance only: largest radius or semi-axis looked for; at least min_radius. Unit: length."""

        max_regions: int
        """Largest number of regions reported; the largest ones stay. Default: 10000."""

        merge: bool
        """Join pieces of one surface into one region. Default: true."""

        mesh: Literal["auto", "vertices", "faces"]
        """What the points of a mesh (STL, OBJ, OFF, PLY with faces) are: its vertices, or points spread evenly over
        the surface that its faces stand for. auto: the faces where the vertices are the corners of large faces
        alone, as in CAD meshes, or else the vertices. Default: auto.
        """

        mesh_points: int
        """Most points on the faces of a mesh. Default: 100000."""

        mesh_spacing: float
        """Distance of the points on the faces of a mesh from each other (when absent so that nine in ten of its smooth
        pieces get 150 points or more, but 20 000 to mesh_points in all). Unit: length.
        """

        method: Literal["distance", "rcond"]
        """distance: every surface and boundary by orthogonal distance. rcond: the seed's growth on the scatter
        matrix's condition. A parameter that is one method's only is not looked at by the other. Default: distance.
        """

        min_points: int
        """Smallest number of points a region may have; below about 30 only clear surfaces are found. Unit: points.
        Default: 50.
        """

        min_radius: float
        """distance only: smallest radius or semi-axis looked for; at most max_radius. Unit: length."""

        name: str
        """What the cloud is called in its report, such as the name of its file."""

        noise_sigma: float
        """distance only: standard deviation of the points' noise (estimated from the cloud when absent). No region is
        reported whose residuals' root mean square is above twice the value given, or above half the tolerance where
        one is given that allows more. Unit: length.
        """

        rcond_threshold: float
        """rcond only: a point joins while the 1-norm reciprocal condition number of the scatter matrix, in raw
        coordinates, stays below this. It depends on the unit and the origin. Default: 0.5e-19.
        """

        refine: bool
        """Refine boundaries and surfaces at the end. Default: true."""

        seed: int
        """Seed of the random generator; the same seed gives the same bytes, timing apart. Default: 0."""

        skip_lines: int
        """How many lines of a text to pass over before it begins, titles and protocols that carry no comment mark.
        Names of columns among them are not looked at. Default: 0.
        """

        snap: bool
        """Whether each region is given a second surface, `snapped`, for which all accepted relations hold exactly.
        Default: false.
        """

        surfaces: list[Literal["plane", "sphere", "cylinder", "elliptic_cylinder", "cone", "ellipsoid", "torus", "elliptic_paraboloid", "hyperbolic_paraboloid", "hyperboloid_one_sheet", "hyperboloid_two_sheets", "parabolic_cylinder", "hyperbolic_cylinder", "elliptic_cone"]]
        """distance only: the surface types looked for, each for itself: ellipsoid does not stand for sphere, nor
        elliptic_cylinder for cylinder. Default: plane, sphere, cylinder, elliptic_cylinder, cone, ellipsoid, torus.
        """

        thin: float
        """Thins the cloud as it is read: of points closer to each other than this one is kept, the surfaces are found
        by those kept, and every other point gets the label of the kept one nearest to it. For clouds larger than
        the memory (all points are used when absent). Unit: length.
        """

        tolerance: float
        """distance only: largest distance of a point from its surface (four noise sigmas when absent); no region has a
        point beyond it. Unit: length.
        """

        unit: Literal["um", "mm", "cm", "m", "km", "in", "ft", "us_ft"]
        """The unit of the cloud's lengths (the one that the file states when absent: E57, LAS with a coordinate
        system, text with names such as 'x [mm]'). It is told in every answer and stated in STEP; nothing is
        converted.
        """

class Snapped(Record):
    """A region's surface after all surfaces were moved, as little as their uncertainties allow, to where the
    accepted relations hold exactly.
    """
    _fields: ClassVar[dict[str, tuple[str, ...]]] = {
        "coefficients": (),
        "coefficients_scale": (),
        "local_coefficients": (),
        "moved": (),
        "p_value": (),
        "surface": ("Plane", "Sphere", "Cylinder", "EllipticCylinder", "Cone", "Ellipsoid", "Torus"),
    }

    if TYPE_CHECKING:

        coefficients: FloatArray | None
        """a1..a10 about the file's origin. null for a torus; so are the other fields of the coefficients."""

        coefficients_scale: Scale | None
        """How the coefficients are scaled."""

        local_coefficients: FloatArray | None
        """a1..a10 about the region's `local_origin`, on the scale of its own `local_coefficients`."""

        moved: float
        """By how many of its standard uncertainties the parameter moved that moved by the most of them."""

        p_value: float
        """Probability of so large a movement of all its parameters, or a larger one, if the surface as it is now is
        the true one.
        """

        surface: Surface
        """The surface in engineering terms."""

class Snapping(Record):
    """What it took to make all accepted relations hold exactly."""
    _fields: ClassVar[dict[str, tuple[str, ...]]] = {
        "chi2": (),
        "freedom": (),
        "p_value": (),
    }

    if TYPE_CHECKING:

        chi2: float
        """Chi-squared by which the surfaces moved, in units of their covariances."""

        freedom: int
        """How many independent equations the accepted relations are."""

        p_value: float
        """Probability of so large a chi-squared, or a larger one, if all accepted relations hold exactly."""

class Sphere(Record):
    """The sphere about `center`."""
    _fields: ClassVar[dict[str, tuple[str, ...]]] = {
        "center": (),
        "radius": (),
        "type": (),
    }

    _lists: ClassVar[frozenset[str]] = frozenset(("center",))

    if TYPE_CHECKING:

        center: FloatArray
        """Centre."""

        radius: float
        """Radius > 0."""

        type: Literal["sphere"]
        """Which surface it is"""

class ThinInput(Record):
    """What was kept of a cloud that was thinned. `labels`, `point_count` and `unassigned` are about all points of
    the input, each with the label of the kept point nearest to it; everything else is about those kept: `fit`,
    uncertainties, `sampling` and what `min_points` counts.
    """
    _fields: ClassVar[dict[str, tuple[str, ...]]] = {
        "kept": (),
        "length": (),
    }

    if TYPE_CHECKING:

        kept: int
        """How many of the points were kept."""

        length: float
        """The least distance of kept points from each other: the parameter `thin`."""

class Timing(Record):
    """How long the steps took, in seconds."""
    _fields: ClassVar[dict[str, tuple[str, ...]]] = {
        "parse": (),
        "stages": (),
        "total": (),
    }

    if TYPE_CHECKING:

        parse: float
        """Reading the cloud."""

        stages: dict[str, float]
        """Each stage of the method, by its name."""

        total: float
        """Reading and segmenting together."""

class Torus(Record):
    """The torus with a circular section, as pipe elbows and fillets of round edges have it. It is no quadric."""
    _fields: ClassVar[dict[str, tuple[str, ...]]] = {
        "axis_direction": (),
        "center": (),
        "major_radius": (),
        "minor_radius": (),
        "type": (),
    }

    _lists: ClassVar[frozenset[str]] = frozenset(("axis_direction", "center"))

    if TYPE_CHECKING:

        axis_direction: FloatArray
        """Unit direction of the axis of revolution; which of the two ways it points means nothing."""

        center: FloatArray
        """Centre."""

        major_radius: float
        """Distance from the centre to the tube's middle line, > 0."""

        minor_radius: float
        """Radius of the tube, > 0; larger than `major_radius` where the surface crosses itself."""

        type: Literal["torus"]
        """Which surface it is"""

class UnassignedPoints(Record):
    """Points without a region."""
    _fields: ClassVar[dict[str, tuple[str, ...]]] = {
        "count": (),
        "reasons": (),
    }

    if TYPE_CHECKING:

        count: int
        """How many."""

        reasons: dict[str, int]
        """How many for each reason: `outlier` (alone, within a volume, or further from every surface than the
        tolerance), `too_small` (a patch of fewer than `min_points`), `no_quadric` (a surface of another type than
        those looked for, or outside the constraints, or with residuals beyond the noise given; with `rcond` all),
        `not_examined` (the work on the cloud came to its bound before), `over_max_regions` (of a region beyond the
        largest `max_regions`), `duplicate` (a further copy of a point that another reason counts), `not_finite` (a
        coordinate is NaN or infinite), `outside` (left out by the hints that crop). More may come. Above 50 000
        points without a region the shares of the first three are estimated.
        """

class Uncertainty(Record):
    """How exactly the parameters of a surface are known: the standard deviation of each, under its name. A point
    has one for each coordinate. A direction has one alone, the angle in radians by which it may be off.
    """
    _fields: ClassVar[dict[str, tuple[str, ...]]] = {
        "apex": (),
        "arc_angle": (),
        "axis_direction": (),
        "axis_point": (),
        "center": (),
        "covariance": (),
        "covariance_of": (),
        "diameter": (),
        "diameters": (),
        "ends": (),
        "half_angle": (),
        "identifiable": (),
        "length": (),
        "major_radius": (),
        "minor_radius": (),
        "normal": (),
        "not_identifiable": (),
        "point": (),
        "radius": (),
        "semi_axes": (),
        "semi_axis_directions": (),
    }

    _lists: ClassVar[frozenset[str]] = frozenset(("covariance", "covariance_of"))

    if TYPE_CHECKING:

        apex: FloatArray | None
        """Of a cone's apex."""

        arc_angle: float | None
        """Of a torus' arc, in radians."""

        axis_direction: float | None
        """Of an axis' direction, in radians."""

        axis_point: FloatArray | None
        """Of an axis' point. It is the one beside the points' centroid, so it does not vary along the axis."""

        center: FloatArray | None
        """Of a centre."""

        covariance: FloatArray
        """Covariance matrix of the components of all parameters."""

        covariance_of: list[str]
        """The parameters whose components are the rows of `covariance`, in their order; each has the components it has
        in the surface, directions x, y and z.
        """

        diameter: float | None
        """Of a diameter."""

        diameters: FloatArray | None
        """Of each diameter."""

        ends: FloatArray | None
        """Of the ends, along the axis or a torus' tube."""

        half_angle: float | None
        """Of a cone's half angle, in radians."""

        identifiable: bool
        """False where the points do not tell a parameter: a radius, semi-axis or angle less than three standard
        deviations from zero, a direction known to no better than a third of a radian.
        """

        length: float | None
        """Of the length between the ends."""

        major_radius: float | None
        """Of a torus' radius about its axis."""

        minor_radius: float | None
        """Of the radius of a torus' tube."""

        normal: float | None
        """Of a plane's normal, in radians."""

        not_identifiable: list[str] | None
        """The parameters that the points do not tell; absent where they tell all."""

        point: FloatArray | None
        """Of a plane's point. It is the one beside the points' centroid, so it does not vary within the plane."""

        radius: float | None
        """Of a radius."""

        semi_axes: FloatArray | None
        """Of each semi-axis."""

        semi_axis_directions: FloatArray | None
        """Of each semi-axis' direction, in radians."""

class Warning(Record):
    """Something of the input that limits the answer."""
    _fields: ClassVar[dict[str, tuple[str, ...]]] = {
        "code": (),
        "message": (),
    }

    if TYPE_CHECKING:

        code: str
        """What it is: `rows_apart`, `coordinate_steps`, `noise_above_spacing`, `holes_at_origin`, `unit_differs`. More
        may come.
        """

        message: str
        """The same in words, with the lengths in question."""

Element = Union[Circle, Line, Plane, Sphere, Cylinder, EllipticCylinder, Cone, Ellipsoid, Torus]

Surface = Union[Plane, Sphere, Cylinder, EllipticCylinder, Cone, Ellipsoid, Torus]

class Keywords(TypedDict, total=False):
    """The parameters and options that `segment` takes; those that are None are left out."""

    method: Literal["distance", "rcond"] | None
    """distance: every surface and boundary by orthogonal distance. rcond: the seed's growth on the scatter
    matrix's condition. A parameter that is one method's only is not looked at by the other. Default: distance.
    """

    tolerance: float | None
    """distance only: largest distance of a point from its surface (four noise sigmas when absent); no region has a
    point beyond it. Unit: length.
    """

    noise_sigma: float | None
    """distance only: standard deviation of the points' noise (estimated from the cloud when absent). No region is
    reported whose residuals' root mean square is above twice the value given, or above half the tolerance where
    one is given that allows more. Unit: length.
    """

    surfaces: Sequence[Literal["plane", "sphere", "cylinder", "elliptic_cylinder", "cone", "ellipsoid", "torus", "elliptic_paraboloid", "hyperbolic_paraboloid", "hyperboloid_one_sheet", "hyperboloid_two_sheets", "parabolic_cylinder", "hyperbolic_cylinder", "elliptic_cone"]] | str | None
    """distance only: the surface types looked for, each for itself: ellipsoid does not stand for sphere, nor
    elliptic_cylinder for cylinder. Repeat it, or write a,b,c. Default: plane, sphere, cylinder,
    elliptic_cylinder, cone, ellipsoid, torus.
    """

    min_points: int | None
    """Smallest number of points a region may have; below about 30 only clear surfaces are found. Unit: points.
    Default: 50.
    """

    max_regions: int | None
    """Largest number of regions reported; the largest ones stay. Default: 10000."""

    connectivity: float | None
    """distance only: largest gap inside one piece of a surface: wider ones part it (none does when absent). Unit:
    length.
    """

    min_radius: float | None
    """distance only: smallest radius or semi-axis looked for; at most max_radius. Unit: length."""

    max_radius: float | None
    """distance only: largest radius or semi-axis looked for; at least min_radius. Unit: length."""

    axis_direction: Sequence[float] | str | None
    """distance only: direction that axes and plane normals must have, as x,y,z. Repeat it, or write a,b,c."""

    axis_tolerance: float | None
    """distance only: largest angle between an axis and axis_direction. Unit: radians. Default: 0.05."""

    seed: int | None
    """Seed of the random generator; the same seed gives the same bytes, timing apart. Default: 0."""

    max_failed_seeds: int | None
    """How many seed points in a row may fail before the search stops. Default: 50."""

    merge: bool | None
    """Join pieces of one surface into one region. Default: true."""

    refine: bool | None
    """Refine boundaries and surfaces at the end. Default: true."""

    rcond_threshold: float | None
    """rcond only: a point joins while the 1-norm reciprocal condition number of the scatter matrix, in raw
    coordinates, stays below this. It depends on the unit and the origin. Default: 0.5e-19.
    """

    algebraic_threshold: float | None
    """rcond only: largest algebraic residual, with a10 = 1, of an extracted point. Default: 5e-5."""

    hints: str | None
    """What you know of places in the cloud: a JSON list of objects, each with a place (at, extent or labels) and a
    type, radius or axis_direction there, or an action (merge, split, crop), such as [{'at': [[1, 2, 3]],
    'type': 'cylinder', 'radius': 10}]. What became of each stands in the answer's hints.
    """

    format: Literal["ply", "xyz", "ptx", "pcd", "las", "e57", "stl", "obj", "off"] | None
    """The cloud's format (from its media type, file name or bytes when absent); other usual endings, such as csv,
    txt and laz, name it too.
    """

    columns: Sequence[int] | str | None
    """Which columns of a text are x, y and z, counted from 1, such as 2,3,4 behind a running number (by their
    names, or the first three, when absent). Repeat it, or write a,b,c.
    """

    skip_lines: int | None
    """How many lines of a text to pass over before it begins, titles and protocols that carry no comment mark.
    Names of columns among them are not looked at. Default: 0.
    """

    unit: Literal["um", "mm", "cm", "m", "km", "in", "ft", "us_ft"] | None
    """The unit of the cloud's lengths (the one that the file states when absent: E57, LAS with a coordinate
    system, text with names such as 'x [mm]'). It is told in every answer and stated in STEP; nothing is
    converted.
    """

    mesh: Literal["auto", "vertices", "faces"] | None
    """What the points of a mesh (STL, OBJ, OFF, PLY with faces) are: its vertices, or points spread evenly over
    the surface that its faces stand for. auto: the faces where the vertices are the corners of large faces
    alone, as in CAD meshes, or else the vertices. Default: auto.
    """

    mesh_spacing: float | None
    """Distance of the points on the faces of a mesh from each other (when absent so that nine in ten of its smooth
    pieces get 150 points or more, but 20 000 to mesh_points in all). Unit: length.
    """

    mesh_points: int | None
    """Most points on the faces of a mesh. Default: 100000."""

    thin: float | None
    """Thins the cloud as it is read: of points closer to each other than this one is kept, the surfaces are found
    by those kept, and every other point gets the label of the kept one nearest to it. For clouds larger than
    the memory (all points are used when absent). Unit: length.
    """

    name: str | None
    """What the cloud is called in its report, such as the name of its file."""

    labels: Literal["inline", "none"] | None
    """Whether the answer holds one label a point. Default: inline."""

    snap: bool | None
    """Whether each region is given a second surface, `snapped`, for which all accepted relations hold exactly.
    Default: false.
    """

    association: Literal["gaussian", "minimum_zone", "minimum_circumscribed", "maximum_inscribed"] | None
    """Fits one feature to all points of each region too, `fits`, by this association, as a fit of these points
    alone would (none is fitted when absent).
    """

    datums: Sequence[int] | str | None
    """Makes a coordinate system of these regions, the primary datum first, after ISO 5459, `datum_system`, of
    their surfaces or, with association, of their fits. Ids of regions are the same for the same cloud and
    parameters (none is made when absent). Repeat it, or write a,b,c.
    """

    deadline: float | None
    """Longest time the work may take (the service's own limit when absent). Unit: seconds."""

class FitKeywords(TypedDict, total=False):
    """The parameters and options that `fit` takes; those that are None are left out."""

    type: Literal["auto", "plane", "sphere", "cylinder", "cone", "elliptic_cylinder", "ellipsoid", "torus", "circle", "line"] | None
    """The type of the feature; auto: the one that tells where the points lie in the fewest words. Default: auto."""

    association: Literal["gaussian", "minimum_zone", "minimum_circumscribed", "maximum_inscribed"] | None
    """gaussian: the least sum of squared distances of all points. minimum_zone: the least largest distance, of a
    line the thinnest cylinder that holds all points. minimum_circumscribed, maximum_inscribed: of a circle,
    sphere or cylinder, the smallest about all points and the largest among them. Default: gaussian.
    """

    radius: float | None
    """A fixed radius: of a sphere, cylinder or circle. Unit: length."""

    axis: Sequence[float] | str | None
    """A fixed direction of the axis, of the line, or of the normal of a plane or circle. Repeat it, or write
    a,b,c.
    """

    half_angle: float | None
    """A fixed half angle of a cone. Unit: radians."""

    outliers: float | None
    """Points further off than this many standard deviations are left out, again and again until none is (none is
    left out when absent). Unit: deviations.
    """

    type_b: float | None
    """Standard uncertainty of what all points have in common, such as the instrument's scale or probe, from
    elsewhere: added in quadrature to the uncertainty of each length, and over the points' size to that of each
    angle. Unit: length.
    """

    coverage: float | None
    """Probability that expanded uncertainties are made for. Default: 0.9545."""

    nominal: float | None
    """Nominal diameter of a circle, sphere, cylinder or of the tube of a torus; of a cone its full angle in
    radians. Unit: length.
    """

    lower: float | None
    """Lower limit deviation from nominal, mostly below 0 (no lower limit when absent). Unit: length."""

    upper: float | None
    """Upper limit deviation from nominal (no upper limit when absent). Unit: length."""

    form_tolerance: float | None
    """Largest form error allowed. Unit: length."""

    residuals: bool | None
    """Whether the answer holds each point's signed distance. Default: false."""

    part: str | None
    """Passed through: the part."""

    serial: str | None
    """Passed through: its serial number."""

    operator: str | None
    """Passed through: who measured."""

    instrument: str | None
    """Passed through: what was measured with."""

    temperature: str | None
    """Passed through: the temperature, with its unit."""

    time: str | None
    """Passed through: when it was measured."""

    format: Literal["ply", "xyz", "ptx", "pcd", "las", "e57", "stl", "obj", "off"] | None
    """The cloud's format (from its media type, file name or bytes when absent); other usual endings, such as csv,
    txt and laz, name it too.
    """

    columns: Sequence[int] | str | None
    """Which columns of a text are x, y and z, counted from 1, such as 2,3,4 behind a running number (by their
    names, or the first three, when absent). Repeat it, or write a,b,c.
    """

    unit: Literal["um", "mm", "cm", "m", "km", "in", "ft", "us_ft"] | None
    """The unit of the cloud's lengths (the one that the file states when absent: E57, LAS with a coordinate
    system, text with names such as 'x [mm]'). It is told in every answer and stated in STEP; nothing is
    converted.
    """

    name: str | None
    """What the cloud is called in its report, such as the name of its file."""

    deadline: float | None
    """Longest time the work may take (the service's own limit when absent). Unit: seconds."""
