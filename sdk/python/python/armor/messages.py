"""The standard messages, with the names and fields of ROS. Angles are in radians, lengths in metres;
axes by REP-103. An array is a numpy array; a received one is read-only, and lies where it arrived.

Written from the definitions in Rust by `ARMOR_BLESS=1 cargo test -p armor-definitions`; not to be edited.
"""

from __future__ import annotations

import enum
import math
from typing import TYPE_CHECKING, List, Optional, Sequence, Union

from armor._message import Message, _array

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


class Point(Message):
    """A position in space."""

    __slots__ = ("x", "y", "z",)
    _fields = (
        ("x", "x", "m", "f64"),
        ("y", "y", "m", "f64"),
        ("z", "z", "m", "f64"),
    )

    x: float
    """Forward, in metres. Unit: m."""
    y: float
    """To the left, in metres. Unit: m."""
    z: float
    """Up, in metres. Unit: m."""

    def __init__(
        self,
        x: float = 0.0,
        y: float = 0.0,
        z: float = 0.0,
    ) -> None:
        self.x = x
        self.y = y
        self.z = z


class Vector3(Message):
    """A vector; its unit is that of the field it is in."""

    __slots__ = ("x", "y", "z",)
    _fields = (
        ("x", "x", None, "f64"),
        ("y", "y", None, "f64"),
        ("z", "z", None, "f64"),
    )

    x: float
    """Along or about the forward axis."""
    y: float
    """Along or about the left axis."""
    z: float
    """Along or about the up axis."""

    def __init__(
        self,
        x: float = 0.0,
        y: float = 0.0,
        z: float = 0.0,
    ) -> None:
        self.x = x
        self.y = y
        self.z = z


class Quaternion(Message):
    """A rotation as a unit quaternion."""

    __slots__ = ("x", "y", "z", "w",)
    _fields = (
        ("x", "x", None, "f64"),
        ("y", "y", None, "f64"),
        ("z", "z", None, "f64"),
        ("w", "w", None, "f64"),
    )

    x: float
    """Imaginary part along x."""
    y: float
    """Imaginary part along y."""
    z: float
    """Imaginary part along z."""
    w: float
    """Real part."""

    def __init__(
        self,
        x: float = 0.0,
        y: float = 0.0,
        z: float = 0.0,
        w: float = 1.0,
    ) -> None:
        self.x = x
        self.y = y
        self.z = z
        self.w = w

    @classmethod
    def from_yaw(cls, yaw_rad: float) -> Quaternion:
        """A rotation about the up axis, counter-clockwise, in radians."""
        return cls(z=math.sin(yaw_rad / 2.0), w=math.cos(yaw_rad / 2.0))

    def yaw_rad(self) -> float:
        """The rotation about the up axis, in radians, in -pi..pi."""
        w, x, y, z = self.w, self.x, self.y, self.z
        return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


class Pose(Message):
    """Position and orientation."""

    __slots__ = ("position", "orientation",)
    _fields = (
        ("position", "position", None, Point),
        ("orientation", "orientation", None, Quaternion),
    )

    position: Point
    """Where."""
    orientation: Quaternion
    """Orientation."""

    def __init__(
        self,
        position: Optional[Point] = None,
        orientation: Optional[Quaternion] = None,
    ) -> None:
        self.position = Point() if position is None else position
        self.orientation = Quaternion() if orientation is None else orientation


class Pose2D(Message):
    """Position and heading on the plane."""

    __slots__ = ("x", "y", "theta",)
    _fields = (
        ("x", "x", "m", "f64"),
        ("y", "y", "m", "f64"),
        ("theta", "theta", "rad", "f64"),
    )

    x: float
    """Forward, in metres. Unit: m."""
    y: float
    """To the left, in metres. Unit: m."""
    theta: float
    """Heading, counter-clockwise from x, in radians. Unit: rad."""

    def __init__(
        self,
        x: float = 0.0,
        y: float = 0.0,
        theta: float = 0.0,
    ) -> None:
        self.x = x
        self.y = y
        self.theta = theta


class PoseStamped(Message):
    """A pose in a frame at a time."""

    __slots__ = ("stamp", "frame", "pose",)
    _fields = (
        ("stamp", "stamp", "s", "f64"),
        ("frame", "frame", None, "string"),
        ("pose", "pose", None, Pose),
    )

    stamp: float
    """System time in seconds. Unit: s."""
    frame: str
    """Frame the pose is in."""
    pose: Pose
    """The pose."""

    def __init__(
        self,
        stamp: float = 0.0,
        frame: str = "",
        pose: Optional[Pose] = None,
    ) -> None:
        self.stamp = stamp
        self.frame = frame
        self.pose = Pose() if pose is None else pose


class PoseArray(Message):
    """Poses in one frame at one time, such as the hypotheses of a particle filter."""

    __slots__ = ("stamp", "frame", "poses",)
    _fields = (
        ("stamp", "stamp", "s", "f64"),
        ("frame", "frame", None, "string"),
        ("poses", "poses", None, ("list", Pose)),
    )

    stamp: float
    """System time in seconds. Unit: s."""
    frame: str
    """Frame the poses are in."""
    poses: List[Pose]
    """The poses."""

    def __init__(
        self,
        stamp: float = 0.0,
        frame: str = "",
        poses: Optional[List[Pose]] = None,
    ) -> None:
        self.stamp = stamp
        self.frame = frame
        self.poses = [] if poses is None else poses


class PoseWithCovariance(Message):
    """A pose and how sure it is."""

    __slots__ = ("pose", "covariance",)
    _fields = (
        ("pose", "pose", None, Pose),
        ("covariance", "covariance", None, ("fixed", "f64", 36)),
    )

    pose: Pose
    """The pose."""
    covariance: List[float]
    """Row-major 6x6 over x, y, z, roll, pitch, yaw; m², m·rad, rad²."""

    def __init__(
        self,
        pose: Optional[Pose] = None,
        covariance: Optional[List[float]] = None,
    ) -> None:
        self.pose = Pose() if pose is None else pose
        self.covariance = [0.0] * 36 if covariance is None else covariance


class PoseWithCovarianceStamped(Message):
    """A pose, how sure it is, in a frame at a time."""

    __slots__ = ("stamp", "frame", "pose",)
    _fields = (
        ("stamp", "stamp", "s", "f64"),
        ("frame", "frame", None, "string"),
        ("pose", "pose", None, PoseWithCovariance),
    )

    stamp: float
    """System time in seconds. Unit: s."""
    frame: str
    """Frame the pose is in."""
    pose: PoseWithCovariance
    """The pose."""

    def __init__(
        self,
        stamp: float = 0.0,
        frame: str = "",
        pose: Optional[PoseWithCovariance] = None,
    ) -> None:
        self.stamp = stamp
        self.frame = frame
        self.pose = PoseWithCovariance() if pose is None else pose


class Twist(Message):
    """A velocity."""

    __slots__ = ("linear", "angular",)
    _fields = (
        ("linear", "linear", "m/s", Vector3),
        ("angular", "angular", "rad/s", Vector3),
    )

    linear: Vector3
    """In metres per second. Unit: m/s."""
    angular: Vector3
    """In radians per second. Unit: rad/s."""

    def __init__(
        self,
        linear: Optional[Vector3] = None,
        angular: Optional[Vector3] = None,
    ) -> None:
        self.linear = Vector3() if linear is None else linear
        self.angular = Vector3() if angular is None else angular


class TwistWithCovariance(Message):
    """A velocity and how sure it is."""

    __slots__ = ("twist", "covariance",)
    _fields = (
        ("twist", "twist", None, Twist),
        ("covariance", "covariance", None, ("fixed", "f64", 36)),
    )

    twist: Twist
    """The velocity."""
    covariance: List[float]
    """Row-major 6x6 over x, y, z, roll, pitch, yaw."""

    def __init__(
        self,
        twist: Optional[Twist] = None,
        covariance: Optional[List[float]] = None,
    ) -> None:
        self.twist = Twist() if twist is None else twist
        self.covariance = [0.0] * 36 if covariance is None else covariance


class FrameTransform(Message):
    """Where a frame is in another one."""

    __slots__ = ("parent", "child", "translation", "rotation",)
    _fields = (
        ("parent", "parent", None, "string"),
        ("child", "child", None, "string"),
        ("translation", "translation", "m", Vector3),
        ("rotation", "rotation", None, Quaternion),
    )

    parent: str
    """The frame that it is in; with its epoch if it has one, such as `map#3f2a`."""
    child: str
    """The frame."""
    translation: Vector3
    """Its origin in the parent, in metres. Unit: m."""
    rotation: Quaternion
    """Its axes in the parent."""

    def __init__(
        self,
        parent: str = "",
        child: str = "",
        translation: Optional[Vector3] = None,
        rotation: Optional[Quaternion] = None,
    ) -> None:
        self.parent = parent
        self.child = child
        self.translation = Vector3() if translation is None else translation
        self.rotation = Quaternion() if rotation is None else rotation


class FrameTransforms(Message):
    """Where frames are in others at a time, as far as they move (ROS: `tf2_msgs/TFMessage`). A frame has one parent, and one component publishes where it is."""

    __slots__ = ("stamp", "transforms",)
    _fields = (
        ("stamp", "stamp", "s", "f64"),
        ("transforms", "transforms", None, ("list", FrameTransform)),
    )

    stamp: float
    """System time in seconds. Unit: s."""
    transforms: List[FrameTransform]
    """The frames."""

    def __init__(
        self,
        stamp: float = 0.0,
        transforms: Optional[List[FrameTransform]] = None,
    ) -> None:
        self.stamp = stamp
        self.transforms = [] if transforms is None else transforms


class MapMetaData(Message):
    """How a map lies in its frame."""

    __slots__ = ("map_load_time", "resolution", "width", "height", "origin",)
    _fields = (
        ("map_load_time", "map_load_time", "s", "f64"),
        ("resolution", "resolution", "m", "f32"),
        ("width", "width", None, "u32"),
        ("height", "height", None, "u32"),
        ("origin", "origin", None, Pose),
    )

    map_load_time: float
    """System time in seconds when the map was made. Unit: s."""
    resolution: float
    """Side of a cell in metres. Unit: m."""
    width: int
    """Cells along x."""
    height: int
    """Cells along y."""
    origin: Pose
    """Pose of the corner of cell (0, 0) in the map's frame."""

    def __init__(
        self,
        map_load_time: float = 0.0,
        resolution: float = 0.0,
        width: int = 0,
        height: int = 0,
        origin: Optional[Pose] = None,
    ) -> None:
        self.map_load_time = map_load_time
        self.resolution = resolution
        self.width = width
        self.height = height
        self.origin = Pose() if origin is None else origin


class OccupancyGrid(Message):
    """Which parts of the plane are occupied."""

    __slots__ = ("stamp", "frame", "info", "data",)
    _fields = (
        ("stamp", "stamp", "s", "f64"),
        ("frame", "frame", None, "string"),
        ("info", "info", None, MapMetaData),
        ("data", "data", None, ("array", "i8")),
    )

    stamp: float
    """System time in seconds. Unit: s."""
    frame: str
    """Frame of the map."""
    info: MapMetaData
    """How it lies there."""
    data: NDArray[np.int8]
    """Row-major from the origin, x first: -1 unknown, 0 free … 100 occupied."""

    def __init__(
        self,
        stamp: float = 0.0,
        frame: str = "",
        info: Optional[MapMetaData] = None,
        data: Union[NDArray[np.int8], Sequence[int], None] = None,
    ) -> None:
        self.stamp = stamp
        self.frame = frame
        self.info = MapMetaData() if info is None else info
        self.data = _array(data, "<i1", "OccupancyGrid.data")


class OccupancyGridUpdate(Message):
    """A rectangle of a map that has changed (`map_msgs`)."""

    __slots__ = ("stamp", "frame", "x", "y", "width", "height", "data",)
    _fields = (
        ("stamp", "stamp", "s", "f64"),
        ("frame", "frame", None, "string"),
        ("x", "x", None, "i32"),
        ("y", "y", None, "i32"),
        ("width", "width", None, "u32"),
        ("height", "height", None, "u32"),
        ("data", "data", None, ("array", "i8")),
    )

    stamp: float
    """System time in seconds. Unit: s."""
    frame: str
    """Frame of the map."""
    x: int
    """First cell along x, of the map published last."""
    y: int
    """First cell along y."""
    width: int
    """Cells along x."""
    height: int
    """Cells along y."""
    data: NDArray[np.int8]
    """As in the map: row-major, x first."""

    def __init__(
        self,
        stamp: float = 0.0,
        frame: str = "",
        x: int = 0,
        y: int = 0,
        width: int = 0,
        height: int = 0,
        data: Union[NDArray[np.int8], Sequence[int], None] = None,
    ) -> None:
        self.stamp = stamp
        self.frame = frame
        self.x = x
        self.y = y
        self.width = width
        self.height = height
        self.data = _array(data, "<i1", "OccupancyGridUpdate.data")


class Path(Message):
    """Poses to follow, in order."""

    __slots__ = ("stamp", "frame", "poses",)
    _fields = (
        ("stamp", "stamp", "s", "f64"),
        ("frame", "frame", None, "string"),
        ("poses", "poses", None, ("list", PoseStamped)),
    )

    stamp: float
    """System time in seconds. Unit: s."""
    frame: str
    """Frame of the path."""
    poses: List[PoseStamped]
    """The poses."""

    def __init__(
        self,
        stamp: float = 0.0,
        frame: str = "",
        poses: Optional[List[PoseStamped]] = None,
    ) -> None:
        self.stamp = stamp
        self.frame = frame
        self.poses = [] if poses is None else poses


class SlamDiagnostics(Message):
    """Quality of mapping and localising, once per scan (our own; ROS has no such message)."""

    __slots__ = ("stamp", "particles", "effective_particles", "match_score", "closures", "update_time", "dropped",)
    _fields = (
        ("stamp", "stamp", "s", "f64"),
        ("particles", "particles", None, "u32"),
        ("effective_particles", "effective_particles", None, "f64"),
        ("match_score", "match_score", None, "f64"),
        ("closures", "closures", None, "u64"),
        ("update_time", "update_time", "s", "f64"),
        ("dropped", "dropped", None, "u64"),
    )

    stamp: float
    """System time of the scan, in seconds. Unit: s."""
    particles: int
    """Number of particles."""
    effective_particles: float
    """Effective number of particles: few when few carry all the weight."""
    match_score: float
    """Share of the scan's points that lie on surfaces of the map, 0 … 1."""
    closures: int
    """Loops closed so far."""
    update_time: float
    """Time the scan took, in seconds. Unit: s."""
    dropped: int
    """Scans dropped because no odometry came for them."""

    def __init__(
        self,
        stamp: float = 0.0,
        particles: int = 0,
        effective_particles: float = 0.0,
        match_score: float = 0.0,
        closures: int = 0,
        update_time: float = 0.0,
        dropped: int = 0,
    ) -> None:
        self.stamp = stamp
        self.particles = particles
        self.effective_particles = effective_particles
        self.match_score = match_score
        self.closures = closures
        self.update_time = update_time
        self.dropped = dropped


class ZoneRule(enum.Enum):
    """What a zone of the map requires of a robot (our own; ROS has no such message)."""

    NoGo = 0
    """It must not enter."""
    StayIn = 1
    """It must not leave. Of several such zones, it must be in one."""
    Speed = 2
    """It must not be faster than the zone's speed."""
    Observe = 3
    """Nothing: that a robot comes near it is reported."""


class Zone(Message):
    """An area of the map, with its boundary: a polygon or a circle (our own)."""

    __slots__ = ("name", "kind", "margin", "speed", "polygon", "centre", "radius",)
    _fields = (
        ("name", "name", None, "string"),
        ("kind", "kind", None, ZoneRule),
        ("margin", "margin", "m", "f64"),
        ("speed", "speed", "m/s", "f64"),
        ("polygon", "polygon", None, ("list", Point)),
        ("centre", "centre", None, Point),
        ("radius", "radius", "m", "f64"),
    )

    name: str
    """Its name, unique among the zones."""
    kind: ZoneRule
    """What it requires."""
    margin: float
    """Distance that the robot's outline must keep from it, in metres; from its boundary where the robot must stay in it. Unit: m."""
    speed: float
    """Fastest speed in a `Speed` zone, in metres per second; 0 in the others. Unit: m/s."""
    polygon: List[Point]
    """Corners of the polygon, in either order, the first one not repeated; empty for a circle."""
    centre: Point
    """Centre of the circle, if it is one."""
    radius: float
    """Radius of the circle, in metres; 0 for a polygon. Unit: m."""

    def __init__(
        self,
        name: str = "",
        kind: ZoneRule = ZoneRule.NoGo,
        margin: float = 0.0,
        speed: float = 0.0,
        polygon: Optional[List[Point]] = None,
        centre: Optional[Point] = None,
        radius: float = 0.0,
    ) -> None:
        self.name = name
        self.kind = kind
        self.margin = margin
        self.speed = speed
        self.polygon = [] if polygon is None else polygon
        self.centre = Point() if centre is None else centre
        self.radius = radius


class Zones(Message):
    """All zones of a map; they replace those before (our own)."""

    __slots__ = ("stamp", "frame", "zones",)
    _fields = (
        ("stamp", "stamp", "s", "f64"),
        ("frame", "frame", None, "string"),
        ("zones", "zones", None, ("list", Zone)),
    )

    stamp: float
    """System time in seconds. Unit: s."""
    frame: str
    """Frame of the map."""
    zones: List[Zone]
    """The zones."""

    def __init__(
        self,
        stamp: float = 0.0,
        frame: str = "",
        zones: Optional[List[Zone]] = None,
    ) -> None:
        self.stamp = stamp
        self.frame = frame
        self.zones = [] if zones is None else zones


class TrackedObject(Message):
    """Another vehicle, person or thing at a position, as it was last seen (our own)."""

    __slots__ = ("id", "sidc", "position", "velocity", "stamp",)
    _fields = (
        ("id", "id", None, "string"),
        ("sidc", "sidc", None, "string"),
        ("position", "position", None, Point),
        ("velocity", "velocity", None, Vector3),
        ("stamp", "stamp", "s", "f64"),
    )

    id: str
    """Its name among the tracks of the sender; the same one in each message."""
    sidc: str
    """Its symbol identification code of APP-6(D): 20 digits, or the older 15 letters."""
    position: Point
    """Where it is."""
    velocity: Vector3
    """Its velocity, in metres per second."""
    stamp: float
    """System time in seconds when it was there. Unit: s."""

    def __init__(
        self,
        id: str = "",
        sidc: str = "",
        position: Optional[Point] = None,
        velocity: Optional[Vector3] = None,
        stamp: float = 0.0,
    ) -> None:
        self.id = id
        self.sidc = sidc
        self.position = Point() if position is None else position
        self.velocity = Vector3() if velocity is None else velocity
        self.stamp = stamp


class Tracks(Message):
    """Others that are tracked: those of which there is news (our own)."""

    __slots__ = ("stamp", "frame", "tracks",)
    _fields = (
        ("stamp", "stamp", "s", "f64"),
        ("frame", "frame", None, "string"),
        ("tracks", "tracks", None, ("list", TrackedObject)),
    )

    stamp: float
    """System time in seconds. Unit: s."""
    frame: str
    """Frame of the positions and velocities."""
    tracks: List[TrackedObject]
    """What is tracked."""

    def __init__(
        self,
        stamp: float = 0.0,
        frame: str = "",
        tracks: Optional[List[TrackedObject]] = None,
    ) -> None:
        self.stamp = stamp
        self.frame = frame
        self.tracks = [] if tracks is None else tracks


class Odometry(Message):
    """The robot's pose and velocity, estimated from its own motion."""

    __slots__ = ("stamp", "frame", "child_frame", "pose", "twist",)
    _fields = (
        ("stamp", "stamp", "s", "f64"),
        ("frame", "frame", None, "string"),
        ("child_frame", "child_frame", None, "string"),
        ("pose", "pose", None, PoseWithCovariance),
        ("twist", "twist", None, TwistWithCovariance),
    )

    stamp: float
    """System time in seconds. Unit: s."""
    frame: str
    """Frame the pose is in, usually `odom`."""
    child_frame: str
    """Frame the velocity is in and whose pose it is, usually `base_link`."""
    pose: PoseWithCovariance
    """Pose of the child frame."""
    twist: TwistWithCovariance
    """Velocity of the child frame, in the child frame."""

    def __init__(
        self,
        stamp: float = 0.0,
        frame: str = "",
        child_frame: str = "",
        pose: Optional[PoseWithCovariance] = None,
        twist: Optional[TwistWithCovariance] = None,
    ) -> None:
        self.stamp = stamp
        self.frame = frame
        self.child_frame = child_frame
        self.pose = PoseWithCovariance() if pose is None else pose
        self.twist = TwistWithCovariance() if twist is None else twist


class LaserScan(Message):
    """One sweep of a planar laser range-finder."""

    __slots__ = ("stamp", "frame", "angle_min", "angle_max", "angle_increment", "time_increment", "scan_time", "range_min", "range_max", "intensities", "ranges",)
    _fields = (
        ("stamp", "stamp", "s", "f64"),
        ("frame", "frame", None, "string"),
        ("angle_min", "angle_min", "rad", "f32"),
        ("angle_max", "angle_max", "rad", "f32"),
        ("angle_increment", "angle_increment", "rad", "f32"),
        ("time_increment", "time_increment", "s", "f32"),
        ("scan_time", "scan_time", "s", "f32"),
        ("range_min", "range_min", "m", "f32"),
        ("range_max", "range_max", "m", "f32"),
        ("intensities", "intensities", None, ("array", "f32")),
        ("ranges", "ranges", "m", ("array", "f32")),
    )

    stamp: float
    """System time in seconds of the first ray. Unit: s."""
    frame: str
    """Frame of the laser; angles are about its z axis, 0 along x, counter-clockwise."""
    angle_min: float
    """Angle of the first ray. Unit: rad."""
    angle_max: float
    """Angle of the last ray. Unit: rad."""
    angle_increment: float
    """Angle from one ray to the next. Unit: rad."""
    time_increment: float
    """Time from one ray to the next. Unit: s."""
    scan_time: float
    """Time from one sweep to the next. Unit: s."""
    range_min: float
    """Shortest range that can be measured. Unit: m."""
    range_max: float
    """Longest range that can be measured. Unit: m."""
    intensities: NDArray[np.float32]
    """Strength of the return of each ray; empty if not measured."""
    ranges: NDArray[np.float32]
    """Range of each ray; outside of `range_min..=range_max` or not finite: nothing seen. Unit: m."""

    def __init__(
        self,
        stamp: float = 0.0,
        frame: str = "",
        angle_min: float = 0.0,
        angle_max: float = 0.0,
        angle_increment: float = 0.0,
        time_increment: float = 0.0,
        scan_time: float = 0.0,
        range_min: float = 0.0,
        range_max: float = 0.0,
        intensities: Union[NDArray[np.float32], Sequence[float], None] = None,
        ranges: Union[NDArray[np.float32], Sequence[float], None] = None,
    ) -> None:
        self.stamp = stamp
        self.frame = frame
        self.angle_min = angle_min
        self.angle_max = angle_max
        self.angle_increment = angle_increment
        self.time_increment = time_increment
        self.scan_time = scan_time
        self.range_min = range_min
        self.range_max = range_max
        self.intensities = _array(intensities, "<f4", "LaserScan.intensities")
        self.ranges = _array(ranges, "<f4", "LaserScan.ranges")


class Image(Message):
    """An uncompressed image."""

    __slots__ = ("stamp", "frame", "height", "width", "encoding", "is_bigendian", "step", "data",)
    _fields = (
        ("stamp", "stamp", "s", "f64"),
        ("frame", "frame", None, "string"),
        ("height", "height", None, "u32"),
        ("width", "width", None, "u32"),
        ("encoding", "encoding", None, "string"),
        ("is_bigendian", "is_bigendian", None, "u8"),
        ("step", "step", "B", "u32"),
        ("data", "data", None, ("array", "u8")),
    )

    stamp: float
    """System time in seconds of the exposure. Unit: s."""
    frame: str
    """Optical frame of the camera: z ahead, x right, y down."""
    height: int
    """Rows."""
    width: int
    """Columns."""
    encoding: str
    """Layout of a pixel: `rgb8`, `bgr8`, `mono8`, `mono16`, …"""
    is_bigendian: int
    """1 if pixels of more than one byte are big-endian."""
    step: int
    """Length of a row in bytes. Unit: B."""
    data: NDArray[np.uint8]
    """The rows, top first."""

    def __init__(
        self,
        stamp: float = 0.0,
        frame: str = "",
        height: int = 0,
        width: int = 0,
        encoding: str = "",
        is_bigendian: int = 0,
        step: int = 0,
        data: Union[NDArray[np.uint8], bytes, Sequence[int], None] = None,
    ) -> None:
        self.stamp = stamp
        self.frame = frame
        self.height = height
        self.width = width
        self.encoding = encoding
        self.is_bigendian = is_bigendian
        self.step = step
        self.data = _array(data, "<u1", "Image.data")


class CompressedImage(Message):
    """A compressed image."""

    __slots__ = ("stamp", "frame", "format", "data",)
    _fields = (
        ("stamp", "stamp", "s", "f64"),
        ("frame", "frame", None, "string"),
        ("format", "format", None, "string"),
        ("data", "data", None, ("array", "u8")),
    )

    stamp: float
    """System time in seconds of the exposure. Unit: s."""
    frame: str
    """Optical frame of the camera."""
    format: str
    """`jpeg` or `png`."""
    data: NDArray[np.uint8]
    """The file."""

    def __init__(
        self,
        stamp: float = 0.0,
        frame: str = "",
        format: str = "",
        data: Union[NDArray[np.uint8], bytes, Sequence[int], None] = None,
    ) -> None:
        self.stamp = stamp
        self.frame = frame
        self.format = format
        self.data = _array(data, "<u1", "CompressedImage.data")


class Detection2D(Message):
    """Something that was recognized in an image: what it is, how sure that is, and where it is in the image, as a rectangle along rows and columns."""

    __slots__ = ("label", "score", "center_x", "center_y", "size_x", "size_y",)
    _fields = (
        ("label", "label", None, "string"),
        ("score", "score", None, "f64"),
        ("center_x", "center_x", None, "f64"),
        ("center_y", "center_y", None, "f64"),
        ("size_x", "size_x", None, "f64"),
        ("size_y", "size_y", None, "f64"),
    )

    label: str
    """What it is, in the words of the detector: `person`."""
    score: float
    """How sure the detector is; its README states the scale."""
    center_x: float
    """Column of the middle, in pixels from the left edge of the image."""
    center_y: float
    """Row of the middle, in pixels from the upper edge of the image."""
    size_x: float
    """Width in pixels."""
    size_y: float
    """Height in pixels."""

    def __init__(
        self,
        label: str = "",
        score: float = 0.0,
        center_x: float = 0.0,
        center_y: float = 0.0,
        size_x: float = 0.0,
        size_y: float = 0.0,
    ) -> None:
        self.label = label
        self.score = score
        self.center_x = center_x
        self.center_y = center_y
        self.size_x = size_x
        self.size_y = size_y


class Detection2DArray(Message):
    """What was recognized in one image; none if the image was searched and nothing was found."""

    __slots__ = ("stamp", "frame", "height", "width", "detections",)
    _fields = (
        ("stamp", "stamp", "s", "f64"),
        ("frame", "frame", None, "string"),
        ("height", "height", None, "u32"),
        ("width", "width", None, "u32"),
        ("detections", "detections", None, ("list", Detection2D)),
    )

    stamp: float
    """System time in seconds of the exposure of the image. Unit: s."""
    frame: str
    """Optical frame of the camera."""
    height: int
    """Rows of the image."""
    width: int
    """Columns of the image."""
    detections: List[Detection2D]
    """The surest first."""

    def __init__(
        self,
        stamp: float = 0.0,
        frame: str = "",
        height: int = 0,
        width: int = 0,
        detections: Optional[List[Detection2D]] = None,
    ) -> None:
        self.stamp = stamp
        self.frame = frame
        self.height = height
        self.width = width
        self.detections = [] if detections is None else detections


class Imu(Message):
    """A measurement of an inertial measurement unit."""

    __slots__ = ("stamp", "frame", "orientation", "orientation_covariance", "angular_velocity", "angular_velocity_covariance", "linear_acceleration", "linear_acceleration_covariance",)
    _fields = (
        ("stamp", "stamp", "s", "f64"),
        ("frame", "frame", None, "string"),
        ("orientation", "orientation", None, Quaternion),
        ("orientation_covariance", "orientation_covariance", None, ("fixed", "f64", 9)),
        ("angular_velocity", "angular_velocity", "rad/s", Vector3),
        ("angular_velocity_covariance", "angular_velocity_covariance", None, ("fixed", "f64", 9)),
        ("linear_acceleration", "linear_acceleration", "m/s2", Vector3),
        ("linear_acceleration_covariance", "linear_acceleration_covariance", None, ("fixed", "f64", 9)),
    )

    stamp: float
    """System time in seconds. Unit: s."""
    frame: str
    """Frame of the unit."""
    orientation: Quaternion
    """Its orientation in the world; the covariance's first element is -1 if it has none."""
    orientation_covariance: List[float]
    """Row-major 3x3 about x, y, z."""
    angular_velocity: Vector3
    """Angular velocity. Unit: rad/s."""
    angular_velocity_covariance: List[float]
    """Row-major 3x3 about x, y, z."""
    linear_acceleration: Vector3
    """Linear acceleration, gravity included. Unit: m/s2."""
    linear_acceleration_covariance: List[float]
    """Row-major 3x3 along x, y, z."""

    def __init__(
        self,
        stamp: float = 0.0,
        frame: str = "",
        orientation: Optional[Quaternion] = None,
        orientation_covariance: Optional[List[float]] = None,
        angular_velocity: Optional[Vector3] = None,
        angular_velocity_covariance: Optional[List[float]] = None,
        linear_acceleration: Optional[Vector3] = None,
        linear_acceleration_covariance: Optional[List[float]] = None,
    ) -> None:
        self.stamp = stamp
        self.frame = frame
        self.orientation = Quaternion() if orientation is None else orientation
        self.orientation_covariance = [0.0] * 9 if orientation_covariance is None else orientation_covariance
        self.angular_velocity = Vector3() if angular_velocity is None else angular_velocity
        self.angular_velocity_covariance = [0.0] * 9 if angular_velocity_covariance is None else angular_velocity_covariance
        self.linear_acceleration = Vector3() if linear_acceleration is None else linear_acceleration
        self.linear_acceleration_covariance = [0.0] * 9 if linear_acceleration_covariance is None else linear_acceleration_covariance


class NavSatStatus(enum.Enum):
    """Kind of a satellite fix."""

    NoFix = 0
    """No position."""
    Fix = 1
    """An unaugmented position."""
    SbasFix = 2
    """With satellite-based augmentation."""
    GbasFix = 3
    """With ground-based augmentation."""


class NavSatService(Message):
    """Satellite systems used; the numbers are `sensor_msgs/NavSatStatus`' bits."""

    __slots__ = ("bits",)
    _fields = (
        ("bits", "bits", None, "u16"),
    )

    bits: int
    """1 GPS, 2 GLONASS, 4 Compass, 8 Galileo, added up."""

    def __init__(
        self,
        bits: int = 0,
    ) -> None:
        self.bits = bits


class NavSatFix(Message):
    """A position from satellites, WGS 84."""

    __slots__ = ("stamp", "frame", "status", "service", "latitude", "longitude", "altitude", "position_covariance", "position_covariance_type",)
    _fields = (
        ("stamp", "stamp", "s", "f64"),
        ("frame", "frame", None, "string"),
        ("status", "status", None, NavSatStatus),
        ("service", "service", None, NavSatService),
        ("latitude", "latitude", "deg", "f64"),
        ("longitude", "longitude", "deg", "f64"),
        ("altitude", "altitude", "m", "f64"),
        ("position_covariance", "position_covariance", None, ("fixed", "f64", 9)),
        ("position_covariance_type", "position_covariance_type", None, "u8"),
    )

    stamp: float
    """System time in seconds. Unit: s."""
    frame: str
    """Frame of the antenna."""
    status: NavSatStatus
    """Kind of the fix."""
    service: NavSatService
    """Systems used."""
    latitude: float
    """Degrees, north positive. Unit: deg."""
    longitude: float
    """Degrees, east positive. Unit: deg."""
    altitude: float
    """Metres above the ellipsoid; NaN if unknown. Unit: m."""
    position_covariance: List[float]
    """Row-major 3x3 over east, north, up, in m²."""
    position_covariance_type: int
    """0 unknown, 1 approximated, 2 diagonal known, 3 known."""

    def __init__(
        self,
        stamp: float = 0.0,
        frame: str = "",
        status: NavSatStatus = NavSatStatus.NoFix,
        service: Optional[NavSatService] = None,
        latitude: float = 0.0,
        longitude: float = 0.0,
        altitude: float = 0.0,
        position_covariance: Optional[List[float]] = None,
        position_covariance_type: int = 0,
    ) -> None:
        self.stamp = stamp
        self.frame = frame
        self.status = status
        self.service = NavSatService() if service is None else service
        self.latitude = latitude
        self.longitude = longitude
        self.altitude = altitude
        self.position_covariance = [0.0] * 9 if position_covariance is None else position_covariance
        self.position_covariance_type = position_covariance_type


class PowerSupplyStatus(enum.Enum):
    """State of the power supply."""

    Unknown = 0
    """Not known."""
    Charging = 1
    """It is being charged."""
    Discharging = 2
    """It is being used."""
    NotCharging = 3
    """It is neither charged nor used."""
    Full = 4
    """It is full."""


class BatteryState(Message):
    """State of a battery. A number that is not measured is NaN."""

    __slots__ = ("stamp", "frame", "voltage", "temperature", "current", "charge", "capacity", "design_capacity", "percentage", "power_supply_status", "present",)
    _fields = (
        ("stamp", "stamp", "s", "f64"),
        ("frame", "frame", None, "string"),
        ("voltage", "voltage", "V", "f32"),
        ("temperature", "temperature", "degC", "f32"),
        ("current", "current", "A", "f32"),
        ("charge", "charge", "Ah", "f32"),
        ("capacity", "capacity", "Ah", "f32"),
        ("design_capacity", "design_capacity", "Ah", "f32"),
        ("percentage", "percentage", None, "f32"),
        ("power_supply_status", "power_supply_status", None, PowerSupplyStatus),
        ("present", "present", None, "bool"),
    )

    stamp: float
    """System time in seconds. Unit: s."""
    frame: str
    """Frame, or place, of the battery."""
    voltage: float
    """Voltage. Unit: V."""
    temperature: float
    """Temperature. Unit: degC."""
    current: float
    """Current; negative when discharging. Unit: A."""
    charge: float
    """Current charge. Unit: Ah."""
    capacity: float
    """Charge when last full. Unit: Ah."""
    design_capacity: float
    """Charge by design. Unit: Ah."""
    percentage: float
    """0..=1."""
    power_supply_status: PowerSupplyStatus
    """State of the power supply."""
    present: bool
    """Whether there is one."""

    def __init__(
        self,
        stamp: float = 0.0,
        frame: str = "",
        voltage: float = 0.0,
        temperature: float = 0.0,
        current: float = 0.0,
        charge: float = 0.0,
        capacity: float = 0.0,
        design_capacity: float = 0.0,
        percentage: float = 0.0,
        power_supply_status: PowerSupplyStatus = PowerSupplyStatus.Unknown,
        present: bool = False,
    ) -> None:
        self.stamp = stamp
        self.frame = frame
        self.voltage = voltage
        self.temperature = temperature
        self.current = current
        self.charge = charge
        self.capacity = capacity
        self.design_capacity = design_capacity
        self.percentage = percentage
        self.power_supply_status = power_supply_status
        self.present = present


class Flag(Message):
    """Yes or no."""

    __slots__ = ("data",)
    _fields = (
        ("data", "data", None, "bool"),
    )

    data: bool
    """The value."""

    def __init__(
        self,
        data: bool = False,
    ) -> None:
        self.data = data


class Number(Message):
    """A number."""

    __slots__ = ("data",)
    _fields = (
        ("data", "data", None, "f64"),
    )

    data: float
    """The value."""

    def __init__(
        self,
        data: float = 0.0,
    ) -> None:
        self.data = data


class Text(Message):
    """Text."""

    __slots__ = ("data",)
    _fields = (
        ("data", "data", None, "string"),
    )

    data: str
    """The value."""

    def __init__(
        self,
        data: str = "",
    ) -> None:
        self.data = data


class Count(Message):
    """How many."""

    __slots__ = ("count",)
    _fields = (
        ("count", "count", None, "u64"),
    )

    count: int
    """The value."""

    def __init__(
        self,
        count: int = 0,
    ) -> None:
        self.count = count


class Log(Message):
    """One line of a log."""

    __slots__ = ("stamp", "level", "name", "msg", "file", "function", "line",)
    _fields = (
        ("stamp", "stamp", "s", "f64"),
        ("level", "level", None, "u8"),
        ("name", "name", None, "string"),
        ("msg", "msg", None, "string"),
        ("file", "file", None, "string"),
        ("function", "function", None, "string"),
        ("line", "line", None, "u32"),
    )

    stamp: float
    """System time in seconds. Unit: s."""
    level: int
    """10 debug, 20 info, 30 warning, 40 error, 50 fatal."""
    name: str
    """The process that logs it."""
    msg: str
    """The text."""
    file: str
    """Source file."""
    function: str
    """Function."""
    line: int
    """Line in the file."""

    def __init__(
        self,
        stamp: float = 0.0,
        level: int = 0,
        name: str = "",
        msg: str = "",
        file: str = "",
        function: str = "",
        line: int = 0,
    ) -> None:
        self.stamp = stamp
        self.level = level
        self.name = name
        self.msg = msg
        self.file = file
        self.function = function
        self.line = line


class Progress(Message):
    """How far a component's task has come (our own; ROS has no such message).  A component whose task takes long may publish it, by convention on an output named `progress`, at about once per second and whenever `task` changes (`ProgressPace`). `armor run` shows the newest one."""

    __slots__ = ("stamp", "task", "fraction", "detail",)
    _fields = (
        ("stamp", "stamp", "s", "f64"),
        ("task", "task", None, "string"),
        ("fraction", "fraction", None, "f32"),
        ("detail", "detail", None, "string"),
    )

    stamp: float
    """System time in seconds. Unit: s."""
    task: str
    """What is being done, such as `exploring`; empty while no task is active."""
    fraction: float
    """Share of the task that is done, 0 … 1 (no unit); NaN if unknown."""
    detail: str
    """Details for people, such as `84 % explored, 3.2 m to the goal`; may be empty."""

    def __init__(
        self,
        stamp: float = 0.0,
        task: str = "",
        fraction: float = math.nan,
        detail: str = "",
    ) -> None:
        self.stamp = stamp
        self.task = task
        self.fraction = fraction
        self.detail = detail
