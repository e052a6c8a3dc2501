// The standard messages, with the names and fields of armor-sdk; units and axes by REP-103.
// Generated from sdk/src/messages; do not edit: ARMOR_BLESS=1 cargo test -p armor-definitions

#ifndef ARMOR_MESSAGES_HPP
#define ARMOR_MESSAGES_HPP

#include <cmath>

#include "armor.hpp"

namespace armor::messages {

// A position in space.
struct Point {
  // Forward, in metres.
  // Unit: m.
  double x{};
  // To the left, in metres.
  // Unit: m.
  double y{};
  // Up, in metres.
  // Unit: m.
  double z{};
};
ARMOR_MESSAGE_NAMED("Point", Point, (x, "m"), (y, "m"), (z, "m"))

// A vector; its unit is that of the field it is in.
struct Vector3 {
  // Along or about the forward axis.
  double x{};
  // Along or about the left axis.
  double y{};
  // Along or about the up axis.
  double z{};
};
ARMOR_MESSAGE_NAMED("Vector3", Vector3, x, y, z)

// A rotation as a unit quaternion.
struct Quaternion {
  // Imaginary part along x.
  double x{};
  // Imaginary part along y.
  double y{};
  // Imaginary part along z.
  double z{};
  // Real part.
  double w = 1.0;
};
ARMOR_MESSAGE_NAMED("Quaternion", Quaternion, x, y, z, w)

// Position and orientation.
struct Pose {
  // Where.
  Point position{};
  // Orientation.
  Quaternion orientation{};
};
ARMOR_MESSAGE_NAMED("Pose", Pose, position, orientation)

// Position and heading on the plane.
struct Pose2D {
  // Forward, in metres.
  // Unit: m.
  double x{};
  // To the left, in metres.
  // Unit: m.
  double y{};
  // Heading, counter-clockwise from x, in radians.
  // Unit: rad.
  double theta{};
};
ARMOR_MESSAGE_NAMED("Pose2D", Pose2D, (x, "m"), (y, "m"), (theta, "rad"))

// A pose in a frame at a time.
struct PoseStamped {
  // System time in seconds.
  // Unit: s.
  double stamp{};
  // Frame the pose is in.
  std::string frame{};
  // The pose.
  Pose pose{};
};
ARMOR_MESSAGE_NAMED("PoseStamped", PoseStamped, (stamp, "s"), frame, pose)

// Poses in one frame at one time, such as the hypotheses of a particle filter.
struct PoseArray {
  // System time in seconds.
  // Unit: s.
  double stamp{};
  // Frame the poses are in.
  std::string frame{};
  // The poses.
  std::vector<Pose> poses{};
};
ARMOR_MESSAGE_NAMED("PoseArray", PoseArray, (stamp, "s"), frame, poses)

// A pose and how sure it is.
struct PoseWithCovariance {
  // The pose.
  Pose pose{};
  // Row-major 6x6 over x, y, z, roll, pitch, yaw; m², m·rad, rad².
  std::array<double, 36> covariance{};
};
ARMOR_MESSAGE_NAMED("PoseWithCovariance", PoseWithCovariance, pose, covariance)

// A pose, how sure it is, in a frame at a time.
struct PoseWithCovarianceStamped {
  // System time in seconds.
  // Unit: s.
  double stamp{};
  // Frame the pose is in.
  std::string frame{};
  // The pose.
  PoseWithCovariance pose{};
};
ARMOR_MESSAGE_NAMED("PoseWithCovarianceStamped", PoseWithCovarianceStamped, (stamp, "s"), frame, pose)

// A velocity.
struct Twist {
  // In metres per second.
  // Unit: m/s.
  Vector3 linear{};
  // In radians per second.
  // Unit: rad/s.
  Vector3 angular{};
};
ARMOR_MESSAGE_NAMED("Twist", Twist, (linear, "m/s"), (angular, "rad/s"))

// A velocity and how sure it is.
struct TwistWithCovariance {
  // The velocity.
  Twist twist{};
  // Row-major 6x6 over x, y, z, roll, pitch, yaw.
  std::array<double, 36> covariance{};
};
ARMOR_MESSAGE_NAMED("TwistWithCovariance", TwistWithCovariance, twist, covariance)

// Where a frame is in another one.
struct FrameTransform {
  // The frame that it is in; with its epoch if it has one, such as `map#3f2a`.
  std::string parent{};
  // The frame.
  std::string child{};
  // Its origin in the parent, in metres.
  // Unit: m.
  Vector3 translation{};
  // Its axes in the parent.
  Quaternion rotation{};
};
ARMOR_MESSAGE_NAMED("FrameTransform", FrameTransform, parent, child, (translation, "m"), rotation)

// Where frames are in others at a time, as far as they move (ROS: `tf2_msgs/TFMessage`). A frame has
// one parent, and one component publishes where it is.
struct FrameTransforms {
  // System time in seconds.
  // Unit: s.
  double stamp{};
  // The frames.
  std::vector<FrameTransform> transforms{};
};
ARMOR_MESSAGE_NAMED("FrameTransforms", FrameTransforms, (stamp, "s"), transforms)

// How a map lies in its frame.
struct MapMetaData {
  // System time in seconds when the map was made.
  // Unit: s.
  double map_load_time{};
  // Side of a cell in metres.
  // Unit: m.
  float resolution{};
  // Cells along x.
  uint32_t width{};
  // Cells along y.
  uint32_t height{};
  // Pose of the corner of cell (0, 0) in the map's frame.
  Pose origin{};
};
ARMOR_MESSAGE_NAMED("MapMetaData", MapMetaData, (map_load_time, "s"), (resolution, "m"), width, height, origin)

// Which parts of the plane are occupied.
struct OccupancyGrid {
  // System time in seconds.
  // Unit: s.
  double stamp{};
  // Frame of the map.
  std::string frame{};
  // How it lies there.
  MapMetaData info{};
  // Row-major from the origin, x first: -1 unknown, 0 free … 100 occupied.
  std::vector<int8_t> data{};
};
ARMOR_MESSAGE_NAMED("OccupancyGrid", OccupancyGrid, (stamp, "s"), frame, info, data)

// As `OccupancyGrid`, with texts and lists that are borrowed: from the message that has arrived, or
// from the sender's memory.
struct OccupancyGridView {
  // System time in seconds.
  // Unit: s.
  double stamp{};
  // Frame of the map.
  std::string_view frame{};
  // How it lies there.
  MapMetaData info{};
  // Row-major from the origin, x first: -1 unknown, 0 free … 100 occupied.
  armor::span<const int8_t> data{};
};
ARMOR_MESSAGE_NAMED("OccupancyGrid", OccupancyGridView, (stamp, "s"), frame, info, data)

// A rectangle of a map that has changed (`map_msgs`).
struct OccupancyGridUpdate {
  // System time in seconds.
  // Unit: s.
  double stamp{};
  // Frame of the map.
  std::string frame{};
  // First cell along x, of the map published last.
  int32_t x{};
  // First cell along y.
  int32_t y{};
  // Cells along x.
  uint32_t width{};
  // Cells along y.
  uint32_t height{};
  // As in the map: row-major, x first.
  std::vector<int8_t> data{};
};
ARMOR_MESSAGE_NAMED("OccupancyGridUpdate", OccupancyGridUpdate, (stamp, "s"), frame, x, y, width, height, data)

// As `OccupancyGridUpdate`, with texts and lists that are borrowed: from the message that has arrived, or
// from the sender's memory.
struct OccupancyGridUpdateView {
  // System time in seconds.
  // Unit: s.
  double stamp{};
  // Frame of the map.
  std::string_view frame{};
  // First cell along x, of the map published last.
  int32_t x{};
  // First cell along y.
  int32_t y{};
  // Cells along x.
  uint32_t width{};
  // Cells along y.
  uint32_t height{};
  // As in the map: row-major, x first.
  armor::span<const int8_t> data{};
};
ARMOR_MESSAGE_NAMED("OccupancyGridUpdate", OccupancyGridUpdateView, (stamp, "s"), frame, x, y, width, height, data)

// Poses to follow, in order.
struct Path {
  // System time in seconds.
  // Unit: s.
  double stamp{};
  // Frame of the path.
  std::string frame{};
  // The poses.
  std::vector<PoseStamped> poses{};
};
ARMOR_MESSAGE_NAMED("Path", Path, (stamp, "s"), frame, poses)

// Quality of mapping and localising, once per scan (our own; ROS has no such message).
struct SlamDiagnostics {
  // System time of the scan, in seconds.
  // Unit: s.
  double stamp{};
  // Number of particles.
  uint32_t particles{};
  // Effective number of particles: few when few carry all the weight.
  double effective_particles{};
  // Share of the scan's points that lie on surfaces of the map, 0 … 1.
  double match_score{};
  // Loops closed so far.
  uint64_t closures{};
  // Time the scan took, in seconds.
  // Unit: s.
  double update_time{};
  // Scans dropped because no odometry came for them.
  uint64_t dropped{};
};
ARMOR_MESSAGE_NAMED("SlamDiagnostics", SlamDiagnostics, (stamp, "s"), particles, effective_particles, match_score, closures, (update_time, "s"), dropped)

// What a zone of the map requires of a robot (our own; ROS has no such message).
enum class ZoneRule : uint32_t {
  // It must not enter.
  NoGo,
  // It must not leave. Of several such zones, it must be in one.
  StayIn,
  // It must not be faster than the zone's speed.
  Speed,
  // Nothing: that a robot comes near it is reported.
  Observe,
};
ARMOR_MESSAGE_ENUM(ZoneRule, NoGo, StayIn, Speed, Observe)

// An area of the map, with its boundary: a polygon or a circle (our own).
struct Zone {
  // Its name, unique among the zones.
  std::string name{};
  // What it requires.
  ZoneRule kind{};
  // Distance that the robot's outline must keep from it, in metres; from its boundary where the
  // robot must stay in it.
  // Unit: m.
  double margin{};
  // Fastest speed in a `Speed` zone, in metres per second; 0 in the others.
  // Unit: m/s.
  double speed{};
  // Corners of the polygon, in either order, the first one not repeated; empty for a circle.
  std::vector<Point> polygon{};
  // Centre of the circle, if it is one.
  Point centre{};
  // Radius of the circle, in metres; 0 for a polygon.
  // Unit: m.
  double radius{};
};
ARMOR_MESSAGE_NAMED("Zone", Zone, name, kind, (margin, "m"), (speed, "m/s"), polygon, centre, (radius, "m"))

// All zones of a map; they replace those before (our own).
struct Zones {
  // System time in seconds.
  // Unit: s.
  double stamp{};
  // Frame of the map.
  std::string frame{};
  // The zones.
  std::vector<Zone> zones{};
};
ARMOR_MESSAGE_NAMED("Zones", Zones, (stamp, "s"), frame, zones)

// Another vehicle, person or thing at a position, as it was last seen (our own).
struct TrackedObject {
  // Its name among the tracks of the sender; the same one in each message.
  std::string id{};
  // Its symbol identification code of APP-6(D): 20 digits, or the older 15 letters.
  std::string sidc{};
  // Where it is.
  Point position{};
  // Its velocity, in metres per second.
  Vector3 velocity{};
  // System time in seconds when it was there.
  // Unit: s.
  double stamp{};
};
ARMOR_MESSAGE_NAMED("TrackedObject", TrackedObject, id, sidc, position, velocity, (stamp, "s"))

// Others that are tracked: those of which there is news (our own).
struct Tracks {
  // System time in seconds.
  // Unit: s.
  double stamp{};
  // Frame of the positions and velocities.
  std::string frame{};
  // What is tracked.
  std::vector<TrackedObject> tracks{};
};
ARMOR_MESSAGE_NAMED("Tracks", Tracks, (stamp, "s"), frame, tracks)

// The robot's pose and velocity, estimated from its own motion.
struct Odometry {
  // System time in seconds.
  // Unit: s.
  double stamp{};
  // Frame the pose is in, usually `odom`.
  std::string frame{};
  // Frame the velocity is in and whose pose it is, usually `base_link`.
  std::string child_frame{};
  // Pose of the child frame.
  PoseWithCovariance pose{};
  // Velocity of the child frame, in the child frame.
  TwistWithCovariance twist{};
};
ARMOR_MESSAGE_NAMED("Odometry", Odometry, (stamp, "s"), frame, child_frame, pose, twist)

// One sweep of a planar laser range-finder.
struct LaserScan {
  // System time in seconds of the first ray.
  // Unit: s.
  double stamp{};
  // Frame of the laser; angles are about its z axis, 0 along x, counter-clockwise.
  std::string frame{};
  // Angle of the first ray.
  // Unit: rad.
  float angle_min{};
  // Angle of the last ray.
  // Unit: rad.
  float angle_max{};
  // Angle from one ray to the next.
  // Unit: rad.
  float angle_increment{};
  // Time from one ray to the next.
  // Unit: s.
  float time_increment{};
  // Time from one sweep to the next.
  // Unit: s.
  float scan_time{};
  // Shortest range that can be measured.
  // Unit: m.
  float range_min{};
  // Longest range that can be measured.
  // Unit: m.
  float range_max{};
  // Strength of the return of each ray; empty if not measured.
  std::vector<float> intensities{};
  // Range of each ray; outside of `range_min..=range_max` or not finite: nothing seen.
  // Unit: m.
  std::vector<float> ranges{};
};
ARMOR_MESSAGE_NAMED("LaserScan", LaserScan, (stamp, "s"), frame, (angle_min, "rad"), (angle_max, "rad"), (angle_increment, "rad"), (time_increment, "s"), (scan_time, "s"), (range_min, "m"), (range_max, "m"), intensities, (ranges, "m"))

// As `LaserScan`, with texts and lists that are borrowed: from the message that has arrived, or
// from the sender's memory.
struct LaserScanView {
  // System time in seconds of the first ray.
  // Unit: s.
  double stamp{};
  // Frame of the laser; angles are about its z axis, 0 along x, counter-clockwise.
  std::string_view frame{};
  // Angle of the first ray.
  // Unit: rad.
  float angle_min{};
  // Angle of the last ray.
  // Unit: rad.
  float angle_max{};
  // Angle from one ray to the next.
  // Unit: rad.
  float angle_increment{};
  // Time from one ray to the next.
  // Unit: s.
  float time_increment{};
  // Time from one sweep to the next.
  // Unit: s.
  float scan_time{};
  // Shortest range that can be measured.
  // Unit: m.
  float range_min{};
  // Longest range that can be measured.
  // Unit: m.
  float range_max{};
  // Strength of the return of each ray; empty if not measured.
  armor::span<const float> intensities{};
  // Range of each ray; outside of `range_min..=range_max` or not finite: nothing seen.
  // Unit: m.
  armor::span<const float> ranges{};
};
ARMOR_MESSAGE_NAMED("LaserScan", LaserScanView, (stamp, "s"), frame, (angle_min, "rad"), (angle_max, "rad"), (angle_increment, "rad"), (time_increment, "s"), (scan_time, "s"), (range_min, "m"), (range_max, "m"), intensities, (ranges, "m"))

// An uncompressed image.
struct Image {
  // System time in seconds of the exposure.
  // Unit: s.
  double stamp{};
  // Optical frame of the camera: z ahead, x right, y down.
  std::string frame{};
  // Rows.
  uint32_t height{};
  // Columns.
  uint32_t width{};
  // Layout of a pixel: `rgb8`, `bgr8`, `mono8`, `mono16`, …
  std::string encoding{};
  // 1 if pixels of more than one byte are big-endian.
  uint8_t is_bigendian{};
  // Length of a row in bytes.
  // Unit: B.
  uint32_t step{};
  // The rows, top first.
  std::vector<uint8_t> data{};
};
ARMOR_MESSAGE_NAMED("Image", Image, (stamp, "s"), frame, height, width, encoding, is_bigendian, (step, "B"), data)

// As `Image`, with texts and lists that are borrowed: from the message that has arrived, or
// from the sender's memory.
struct ImageView {
  // System time in seconds of the exposure.
  // Unit: s.
  double stamp{};
  // Optical frame of the camera: z ahead, x right, y down.
  std::string_view frame{};
  // Rows.
  uint32_t height{};
  // Columns.
  uint32_t width{};
  // Layout of a pixel: `rgb8`, `bgr8`, `mono8`, `mono16`, …
  std::string_view encoding{};
  // 1 if pixels of more than one byte are big-endian.
  uint8_t is_bigendian{};
  // Length of a row in bytes.
  // Unit: B.
  uint32_t step{};
  // The rows, top first.
  armor::span<const uint8_t> data{};
};
ARMOR_MESSAGE_NAMED("Image", ImageView, (stamp, "s"), frame, height, width, encoding, is_bigendian, (step, "B"), data)

// A compressed image.
struct CompressedImage {
  // System time in seconds of the exposure.
  // Unit: s.
  double stamp{};
  // Optical frame of the camera.
  std::string frame{};
  // `jpeg` or `png`.
  std::string format{};
  // The file.
  std::vector<uint8_t> data{};
};
ARMOR_MESSAGE_NAMED("CompressedImage", CompressedImage, (stamp, "s"), frame, format, data)

// As `CompressedImage`, with texts and lists that are borrowed: from the message that has arrived, or
// from the sender's memory.
struct CompressedImageView {
  // System time in seconds of the exposure.
  // Unit: s.
  double stamp{};
  // Optical frame of the camera.
  std::string_view frame{};
  // `jpeg` or `png`.
  std::string_view format{};
  // The file.
  armor::span<const uint8_t> data{};
};
ARMOR_MESSAGE_NAMED("CompressedImage", CompressedImageView, (stamp, "s"), frame, format, data)

// Something that was recognized in an image: what it is, how sure that is, and where it is in the image,
// as a rectangle along rows and columns.
struct Detection2D {
  // What it is, in the words of the detector: `person`.
  std::string label{};
  // How sure the detector is; its README states the scale.
  double score{};
  // Column of the middle, in pixels from the left edge of the image.
  double center_x{};
  // Row of the middle, in pixels from the upper edge of the image.
  double center_y{};
  // Width in pixels.
  double size_x{};
  // Height in pixels.
  double size_y{};
};
ARMOR_MESSAGE_NAMED("Detection2D", Detection2D, label, score, center_x, center_y, size_x, size_y)

// What was recognized in one image; none if the image was searched and nothing was found.
struct Detection2DArray {
  // System time in seconds of the exposure of the image.
  // Unit: s.
  double stamp{};
  // Optical frame of the camera.
  std::string frame{};
  // Rows of the image.
  uint32_t height{};
  // Columns of the image.
  uint32_t width{};
  // The surest first.
  std::vector<Detection2D> detections{};
};
ARMOR_MESSAGE_NAMED("Detection2DArray", Detection2DArray, (stamp, "s"), frame, height, width, detections)

// A measurement of an inertial measurement unit.
struct Imu {
  // System time in seconds.
  // Unit: s.
  double stamp{};
  // Frame of the unit.
  std::string frame{};
  // Its orientation in the world; the covariance's first element is -1 if it has none.
  Quaternion orientation{};
  // Row-major 3x3 about x, y, z.
  std::array<double, 9> orientation_covariance{};
  // Angular velocity.
  // Unit: rad/s.
  Vector3 angular_velocity{};
  // Row-major 3x3 about x, y, z.
  std::array<double, 9> angular_velocity_covariance{};
  // Linear acceleration, gravity included.
  // Unit: m/s2.
  Vector3 linear_acceleration{};
  // Row-major 3x3 along x, y, z.
  std::array<double, 9> linear_acceleration_covariance{};
};
ARMOR_MESSAGE_NAMED("Imu", Imu, (stamp, "s"), frame, orientation, orientation_covariance, (angular_velocity, "rad/s"), angular_velocity_covariance, (linear_acceleration, "m/s2"), linear_acceleration_covariance)

// Kind of a satellite fix.
enum class NavSatStatus : uint32_t {
  // No position.
  NoFix,
  // An unaugmented position.
  Fix,
  // With satellite-based augmentation.
  SbasFix,
  // With ground-based augmentation.
  GbasFix,
};
ARMOR_MESSAGE_ENUM(NavSatStatus, NoFix, Fix, SbasFix, GbasFix)

// Satellite systems used; the numbers are `sensor_msgs/NavSatStatus`' bits.
struct NavSatService {
  // 1 GPS, 2 GLONASS, 4 Compass, 8 Galileo, added up.
  uint16_t bits{};
};
ARMOR_MESSAGE_NAMED("NavSatService", NavSatService, bits)

// A position from satellites, WGS 84.
struct NavSatFix {
  // System time in seconds.
  // Unit: s.
  double stamp{};
  // Frame of the antenna.
  std::string frame{};
  // Kind of the fix.
  NavSatStatus status{};
  // Systems used.
  NavSatService service{};
  // Degrees, north positive.
  // Unit: deg.
  double latitude{};
  // Degrees, east positive.
  // Unit: deg.
  double longitude{};
  // Metres above the ellipsoid; NaN if unknown.
  // Unit: m.
  double altitude{};
  // Row-major 3x3 over east, north, up, in m².
  std::array<double, 9> position_covariance{};
  // 0 unknown, 1 approximated, 2 diagonal known, 3 known.
  uint8_t position_covariance_type{};
};
ARMOR_MESSAGE_NAMED("NavSatFix", NavSatFix, (stamp, "s"), frame, status, service, (latitude, "deg"), (longitude, "deg"), (altitude, "m"), position_covariance, position_covariance_type)

// State of the power supply.
enum class PowerSupplyStatus : uint32_t {
  // Not known.
  Unknown,
  // It is being charged.
  Charging,
  // It is being used.
  Discharging,
  // It is neither charged nor used.
  NotCharging,
  // It is full.
  Full,
};
ARMOR_MESSAGE_ENUM(PowerSupplyStatus, Unknown, Charging, Discharging, NotCharging, Full)

// State of a battery. A number that is not measured is NaN.
struct BatteryState {
  // System time in seconds.
  // Unit: s.
  double stamp{};
  // Frame, or place, of the battery.
  std::string frame{};
  // Voltage.
  // Unit: V.
  float voltage{};
  // Temperature.
  // Unit: degC.
  float temperature{};
  // Current; negative when discharging.
  // Unit: A.
  float current{};
  // Current charge.
  // Unit: Ah.
  float charge{};
  // Charge when last full.
  // Unit: Ah.
  float capacity{};
  // Charge by design.
  // Unit: Ah.
  float design_capacity{};
  // 0..=1.
  float percentage{};
  // State of the power supply.
  PowerSupplyStatus power_supply_status{};
  // Whether there is one.
  bool present{};
};
ARMOR_MESSAGE_NAMED("BatteryState", BatteryState, (stamp, "s"), frame, (voltage, "V"), (temperature, "degC"), (current, "A"), (charge, "Ah"), (capacity, "Ah"), (design_capacity, "Ah"), percentage, power_supply_status, present)

// Yes or no.
struct Flag {
  // The value.
  bool data{};
};
ARMOR_MESSAGE_NAMED("Flag", Flag, data)

// A number.
struct Number {
  // The value.
  double data{};
};
ARMOR_MESSAGE_NAMED("Number", Number, data)

// Text.
struct Text {
  // The value.
  std::string data{};
};
ARMOR_MESSAGE_NAMED("Text", Text, data)

// How many.
struct Count {
  // The value.
  uint64_t count{};
};
ARMOR_MESSAGE_NAMED("Count", Count, count)

// One line of a log.
struct Log {
  // System time in seconds.
  // Unit: s.
  double stamp{};
  // 10 debug, 20 info, 30 warning, 40 error, 50 fatal.
  uint8_t level{};
  // The process that logs it.
  std::string name{};
  // The text.
  std::string msg{};
  // Source file.
  std::string file{};
  // Function.
  std::string function{};
  // Line in the file.
  uint32_t line{};
};
ARMOR_MESSAGE_NAMED("Log", Log, (stamp, "s"), level, name, msg, file, function, line)

// How far a component's task has come (our own; ROS has no such message).
// 
// A component whose task takes long may publish it, by convention on an output named `progress`,
// at about once per second and whenever `task` changes (`ProgressPace`). `armor run` shows the
// newest one.
struct Progress {
  // System time in seconds.
  // Unit: s.
  double stamp{};
  // What is being done, such as `exploring`; empty while no task is active.
  std::string task{};
  // Share of the task that is done, 0 … 1 (no unit); NaN if unknown.
  float fraction = std::nanf("");
  // Details for people, such as `84 % explored, 3.2 m to the goal`; may be empty.
  std::string detail{};
};
ARMOR_MESSAGE_NAMED("Progress", Progress, (stamp, "s"), task, fraction, detail)

}  // namespace armor::messages

#endif  // ARMOR_MESSAGES_HPP
