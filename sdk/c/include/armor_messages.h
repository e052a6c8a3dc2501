// The standard messages, with the names and fields of armor-sdk; units and axes by REP-103.
// Generated from sdk/src/messages; do not edit: ARMOR_BLESS=1 cargo test -p armor-definitions

#ifndef ARMOR_MESSAGES_H
#define ARMOR_MESSAGES_H

#include "armor.h"

#ifdef __cplusplus
#error "C++ includes armor_messages.hpp"
#endif

// A position in space.
typedef struct armor_point {
  // Forward, in metres.
  // Unit: m.
  double x;
  // To the left, in metres.
  // Unit: m.
  double y;
  // Up, in metres.
  // Unit: m.
  double z;
} armor_point;
ARMOR_STRUCT(armor_point, "Point",
  ARMOR_FIELD(armor_point, x, "m"),
  ARMOR_FIELD(armor_point, y, "m"),
  ARMOR_FIELD(armor_point, z, "m"));

// A vector; its unit is that of the field it is in.
typedef struct armor_vector3 {
  // Along or about the forward axis.
  double x;
  // Along or about the left axis.
  double y;
  // Along or about the up axis.
  double z;
} armor_vector3;
ARMOR_STRUCT(armor_vector3, "Vector3",
  ARMOR_FIELD(armor_vector3, x, ""),
  ARMOR_FIELD(armor_vector3, y, ""),
  ARMOR_FIELD(armor_vector3, z, ""));

// A rotation as a unit quaternion.
typedef struct armor_quaternion {
  // Imaginary part along x.
  double x;
  // Imaginary part along y.
  double y;
  // Imaginary part along z.
  double z;
  // Real part.
  double w;
} armor_quaternion;
ARMOR_STRUCT(armor_quaternion, "Quaternion",
  ARMOR_FIELD(armor_quaternion, x, ""),
  ARMOR_FIELD(armor_quaternion, y, ""),
  ARMOR_FIELD(armor_quaternion, z, ""),
  ARMOR_FIELD(armor_quaternion, w, ""));

// Position and orientation.
typedef struct armor_pose {
  // Where.
  armor_point position;
  // Orientation.
  armor_quaternion orientation;
} armor_pose;
ARMOR_STRUCT(armor_pose, "Pose",
  ARMOR_NESTED(armor_pose, position, armor_point, ""),
  ARMOR_NESTED(armor_pose, orientation, armor_quaternion, ""));

// Position and heading on the plane.
typedef struct armor_pose2d {
  // Forward, in metres.
  // Unit: m.
  double x;
  // To the left, in metres.
  // Unit: m.
  double y;
  // Heading, counter-clockwise from x, in radians.
  // Unit: rad.
  double theta;
} armor_pose2d;
ARMOR_STRUCT(armor_pose2d, "Pose2D",
  ARMOR_FIELD(armor_pose2d, x, "m"),
  ARMOR_FIELD(armor_pose2d, y, "m"),
  ARMOR_FIELD(armor_pose2d, theta, "rad"));

// A pose in a frame at a time.
typedef struct armor_pose_stamped {
  // System time in seconds.
  // Unit: s.
  double stamp;
  // Frame the pose is in.
  armor_string frame;
  // The pose.
  armor_pose pose;
} armor_pose_stamped;
ARMOR_STRUCT(armor_pose_stamped, "PoseStamped",
  ARMOR_FIELD(armor_pose_stamped, stamp, "s"),
  ARMOR_FIELD(armor_pose_stamped, frame, ""),
  ARMOR_NESTED(armor_pose_stamped, pose, armor_pose, ""));

// Poses in one frame at one time, such as the hypotheses of a particle filter.
typedef struct armor_pose_array {
  // System time in seconds.
  // Unit: s.
  double stamp;
  // Frame the poses are in.
  armor_string frame;
  // The poses.
  ARMOR_LIST_OF(armor_pose) poses;
} armor_pose_array;
ARMOR_STRUCT(armor_pose_array, "PoseArray",
  ARMOR_FIELD(armor_pose_array, stamp, "s"),
  ARMOR_FIELD(armor_pose_array, frame, ""),
  ARMOR_NESTED_LIST(armor_pose_array, poses, armor_pose));

// A pose and how sure it is.
typedef struct armor_pose_with_covariance {
  // The pose.
  armor_pose pose;
  // Row-major 6x6 over x, y, z, roll, pitch, yaw; m², m·rad, rad².
  double covariance[36];
} armor_pose_with_covariance;
ARMOR_STRUCT(armor_pose_with_covariance, "PoseWithCovariance",
  ARMOR_NESTED(armor_pose_with_covariance, pose, armor_pose, ""),
  ARMOR_ARRAY(armor_pose_with_covariance, covariance, ""));

// A pose, how sure it is, in a frame at a time.
typedef struct armor_pose_with_covariance_stamped {
  // System time in seconds.
  // Unit: s.
  double stamp;
  // Frame the pose is in.
  armor_string frame;
  // The pose.
  armor_pose_with_covariance pose;
} armor_pose_with_covariance_stamped;
ARMOR_STRUCT(armor_pose_with_covariance_stamped, "PoseWithCovarianceStamped",
  ARMOR_FIELD(armor_pose_with_covariance_stamped, stamp, "s"),
  ARMOR_FIELD(armor_pose_with_covariance_stamped, frame, ""),
  ARMOR_NESTED(armor_pose_with_covariance_stamped, pose, armor_pose_with_covariance, ""));

// A velocity.
typedef struct armor_twist {
  // In metres per second.
  // Unit: m/s.
  armor_vector3 linear;
  // In radians per second.
  // Unit: rad/s.
  armor_vector3 angular;
} armor_twist;
ARMOR_STRUCT(armor_twist, "Twist",
  ARMOR_NESTED(armor_twist, linear, armor_vector3, "m/s"),
  ARMOR_NESTED(armor_twist, angular, armor_vector3, "rad/s"));

// A velocity and how sure it is.
typedef struct armor_twist_with_covariance {
  // The velocity.
  armor_twist twist;
  // Row-major 6x6 over x, y, z, roll, pitch, yaw.
  double covariance[36];
} armor_twist_with_covariance;
ARMOR_STRUCT(armor_twist_with_covariance, "TwistWithCovariance",
  ARMOR_NESTED(armor_twist_with_covariance, twist, armor_twist, ""),
  ARMOR_ARRAY(armor_twist_with_covariance, covariance, ""));

// Where a frame is in another one.
typedef struct armor_frame_transform {
  // The frame that it is in; with its epoch if it has one, such as `map#3f2a`.
  armor_string parent;
  // The frame.
  armor_string child;
  // Its origin in the parent, in metres.
  // Unit: m.
  armor_vector3 translation;
  // Its axes in the parent.
  armor_quaternion rotation;
} armor_frame_transform;
ARMOR_STRUCT(armor_frame_transform, "FrameTransform",
  ARMOR_FIELD(armor_frame_transform, parent, ""),
  ARMOR_FIELD(armor_frame_transform, child, ""),
  ARMOR_NESTED(armor_frame_transform, translation, armor_vector3, "m"),
  ARMOR_NESTED(armor_frame_transform, rotation, armor_quaternion, ""));

// Where frames are in others at a time, as far as they move (ROS: `tf2_msgs/TFMessage`). A frame has
// one parent, and one component publishes where it is.
typedef struct armor_frame_transforms {
  // System time in seconds.
  // Unit: s.
  double stamp;
  // The frames.
  ARMOR_LIST_OF(armor_frame_transform) transforms;
} armor_frame_transforms;
ARMOR_STRUCT(armor_frame_transforms, "FrameTransforms",
  ARMOR_FIELD(armor_frame_transforms, stamp, "s"),
  ARMOR_NESTED_LIST(armor_frame_transforms, transforms, armor_frame_transform));

// How a map lies in its frame.
typedef struct armor_map_meta_data {
  // System time in seconds when the map was made.
  // Unit: s.
  double map_load_time;
  // Side of a cell in metres.
  // Unit: m.
  float resolution;
  // Cells along x.
  uint32_t width;
  // Cells along y.
  uint32_t height;
  // Pose of the corner of cell (0, 0) in the map's frame.
  armor_pose origin;
} armor_map_meta_data;
ARMOR_STRUCT(armor_map_meta_data, "MapMetaData",
  ARMOR_FIELD(armor_map_meta_data, map_load_time, "s"),
  ARMOR_FIELD(armor_map_meta_data, resolution, "m"),
  ARMOR_FIELD(armor_map_meta_data, width, ""),
  ARMOR_FIELD(armor_map_meta_data, height, ""),
  ARMOR_NESTED(armor_map_meta_data, origin, armor_pose, ""));

// Which parts of the plane are occupied.
typedef struct armor_occupancy_grid {
  // System time in seconds.
  // Unit: s.
  double stamp;
  // Frame of the map.
  armor_string frame;
  // How it lies there.
  armor_map_meta_data info;
  // Row-major from the origin, x first: -1 unknown, 0 free … 100 occupied.
  armor_i8_list data;
} armor_occupancy_grid;
ARMOR_STRUCT(armor_occupancy_grid, "OccupancyGrid",
  ARMOR_FIELD(armor_occupancy_grid, stamp, "s"),
  ARMOR_FIELD(armor_occupancy_grid, frame, ""),
  ARMOR_NESTED(armor_occupancy_grid, info, armor_map_meta_data, ""),
  ARMOR_LIST(armor_occupancy_grid, data, ""));

// A rectangle of a map that has changed (`map_msgs`).
typedef struct armor_occupancy_grid_update {
  // System time in seconds.
  // Unit: s.
  double stamp;
  // Frame of the map.
  armor_string frame;
  // First cell along x, of the map published last.
  int32_t x;
  // First cell along y.
  int32_t y;
  // Cells along x.
  uint32_t width;
  // Cells along y.
  uint32_t height;
  // As in the map: row-major, x first.
  armor_i8_list data;
} armor_occupancy_grid_update;
ARMOR_STRUCT(armor_occupancy_grid_update, "OccupancyGridUpdate",
  ARMOR_FIELD(armor_occupancy_grid_update, stamp, "s"),
  ARMOR_FIELD(armor_occupancy_grid_update, frame, ""),
  ARMOR_FIELD(armor_occupancy_grid_update, x, ""),
  ARMOR_FIELD(armor_occupancy_grid_update, y, ""),
  ARMOR_FIELD(armor_occupancy_grid_update, width, ""),
  ARMOR_FIELD(armor_occupancy_grid_update, height, ""),
  ARMOR_LIST(armor_occupancy_grid_update, data, ""));

// Poses to follow, in order.
typedef struct armor_path {
  // System time in seconds.
  // Unit: s.
  double stamp;
  // Frame of the path.
  armor_string frame;
  // The poses.
  ARMOR_LIST_OF(armor_pose_stamped) poses;
} armor_path;
ARMOR_STRUCT(armor_path, "Path",
  ARMOR_FIELD(armor_path, stamp, "s"),
  ARMOR_FIELD(armor_path, frame, ""),
  ARMOR_NESTED_LIST(armor_path, poses, armor_pose_stamped));

// Quality of mapping and localising, once per scan (our own; ROS has no such message).
typedef struct armor_slam_diagnostics {
  // System time of the scan, in seconds.
  // Unit: s.
  double stamp;
  // Number of particles.
  uint32_t particles;
  // Effective number of particles: few when few carry all the weight.
  double effective_particles;
  // Share of the scan's points that lie on surfaces of the map, 0 … 1.
  double match_score;
  // Loops closed so far.
  uint64_t closures;
  // Time the scan took, in seconds.
  // Unit: s.
  double update_time;
  // Scans dropped because no odometry came for them.
  uint64_t dropped;
} armor_slam_diagnostics;
ARMOR_STRUCT(armor_slam_diagnostics, "SlamDiagnostics",
  ARMOR_FIELD(armor_slam_diagnostics, stamp, "s"),
  ARMOR_FIELD(armor_slam_diagnostics, particles, ""),
  ARMOR_FIELD(armor_slam_diagnostics, effective_particles, ""),
  ARMOR_FIELD(armor_slam_diagnostics, match_score, ""),
  ARMOR_FIELD(armor_slam_diagnostics, closures, ""),
  ARMOR_FIELD(armor_slam_diagnostics, update_time, "s"),
  ARMOR_FIELD(armor_slam_diagnostics, dropped, ""));

// What a zone of the map requires of a robot (our own; ROS has no such message).
typedef enum armor_zone_rule {
  // It must not enter.
  ARMOR_ZONE_RULE_NO_GO,
  // It must not leave. Of several such zones, it must be in one.
  ARMOR_ZONE_RULE_STAY_IN,
  // It must not be faster than the zone's speed.
  ARMOR_ZONE_RULE_SPEED,
  // Nothing: that a robot comes near it is reported.
  ARMOR_ZONE_RULE_OBSERVE,
} armor_zone_rule;
ARMOR_ENUM(armor_zone_rule, "ZoneRule", "NoGo", "StayIn", "Speed", "Observe");

// An area of the map, with its boundary: a polygon or a circle (our own).
typedef struct armor_zone {
  // Its name, unique among the zones.
  armor_string name;
  // What it requires.
  armor_zone_rule kind;
  // Distance that the robot's outline must keep from it, in metres; from its boundary where the
  // robot must stay in it.
  // Unit: m.
  double margin;
  // Fastest speed in a `Speed` zone, in metres per second; 0 in the others.
  // Unit: m/s.
  double speed;
  // Corners of the polygon, in either order, the first one not repeated; empty for a circle.
  ARMOR_LIST_OF(armor_point) polygon;
  // Centre of the circle, if it is one.
  armor_point centre;
  // Radius of the circle, in metres; 0 for a polygon.
  // Unit: m.
  double radius;
} armor_zone;
ARMOR_STRUCT(armor_zone, "Zone",
  ARMOR_FIELD(armor_zone, name, ""),
  ARMOR_NESTED(armor_zone, kind, armor_zone_rule, ""),
  ARMOR_FIELD(armor_zone, margin, "m"),
  ARMOR_FIELD(armor_zone, speed, "m/s"),
  ARMOR_NESTED_LIST(armor_zone, polygon, armor_point),
  ARMOR_NESTED(armor_zone, centre, armor_point, ""),
  ARMOR_FIELD(armor_zone, radius, "m"));

// All zones of a map; they replace those before (our own).
typedef struct armor_zones {
  // System time in seconds.
  // Unit: s.
  double stamp;
  // Frame of the map.
  armor_string frame;
  // The zones.
  ARMOR_LIST_OF(armor_zone) zones;
} armor_zones;
ARMOR_STRUCT(armor_zones, "Zones",
  ARMOR_FIELD(armor_zones, stamp, "s"),
  ARMOR_FIELD(armor_zones, frame, ""),
  ARMOR_NESTED_LIST(armor_zones, zones, armor_zone));

// Another vehicle, person or thing at a position, as it was last seen (our own).
typedef struct armor_tracked_object {
  // Its name among the tracks of the sender; the same one in each message.
  armor_string id;
  // Its symbol identification code of APP-6(D): 20 digits, or the older 15 letters.
  armor_string sidc;
  // Where it is.
  armor_point position;
  // Its velocity, in metres per second.
  armor_vector3 velocity;
  // System time in seconds when it was there.
  // Unit: s.
  double stamp;
} armor_tracked_object;
ARMOR_STRUCT(armor_tracked_object, "TrackedObject",
  ARMOR_FIELD(armor_tracked_object, id, ""),
  ARMOR_FIELD(armor_tracked_object, sidc, ""),
  ARMOR_NESTED(armor_tracked_object, position, armor_point, ""),
  ARMOR_NESTED(armor_tracked_object, velocity, armor_vector3, ""),
  ARMOR_FIELD(armor_tracked_object, stamp, "s"));

// Others that are tracked: those of which there is news (our own).
typedef struct armor_tracks {
  // System time in seconds.
  // Unit: s.
  double stamp;
  // Frame of the positions and velocities.
  armor_string frame;
  // What is tracked.
  ARMOR_LIST_OF(armor_tracked_object) tracks;
} armor_tracks;
ARMOR_STRUCT(armor_tracks, "Tracks",
  ARMOR_FIELD(armor_tracks, stamp, "s"),
  ARMOR_FIELD(armor_tracks, frame, ""),
  ARMOR_NESTED_LIST(armor_tracks, tracks, armor_tracked_object));

// The robot's pose and velocity, estimated from its own motion.
typedef struct armor_odometry {
  // System time in seconds.
  // Unit: s.
  double stamp;
  // Frame the pose is in, usually `odom`.
  armor_string frame;
  // Frame the velocity is in and whose pose it is, usually `base_link`.
  armor_string child_frame;
  // Pose of the child frame.
  armor_pose_with_covariance pose;
  // Velocity of the child frame, in the child frame.
  armor_twist_with_covariance twist;
} armor_odometry;
ARMOR_STRUCT(armor_odometry, "Odometry",
  ARMOR_FIELD(armor_odometry, stamp, "s"),
  ARMOR_FIELD(armor_odometry, frame, ""),
  ARMOR_FIELD(armor_odometry, child_frame, ""),
  ARMOR_NESTED(armor_odometry, pose, armor_pose_with_covariance, ""),
  ARMOR_NESTED(armor_odometry, twist, armor_twist_with_covariance, ""));

// One sweep of a planar laser range-finder.
typedef struct armor_laser_scan {
  // System time in seconds of the first ray.
  // Unit: s.
  double stamp;
  // Frame of the laser; angles are about its z axis, 0 along x, counter-clockwise.
  armor_string frame;
  // Angle of the first ray.
  // Unit: rad.
  float angle_min;
  // Angle of the last ray.
  // Unit: rad.
  float angle_max;
  // Angle from one ray to the next.
  // Unit: rad.
  float angle_increment;
  // Time from one ray to the next.
  // Unit: s.
  float time_increment;
  // Time from one sweep to the next.
  // Unit: s.
  float scan_time;
  // Shortest range that can be measured.
  // Unit: m.
  float range_min;
  // Longest range that can be measured.
  // Unit: m.
  float range_max;
  // Strength of the return of each ray; empty if not measured.
  armor_f32_list intensities;
  // Range of each ray; outside of `range_min..=range_max` or not finite: nothing seen.
  // Unit: m.
  armor_f32_list ranges;
} armor_laser_scan;
ARMOR_STRUCT(armor_laser_scan, "LaserScan",
  ARMOR_FIELD(armor_laser_scan, stamp, "s"),
  ARMOR_FIELD(armor_laser_scan, frame, ""),
  ARMOR_FIELD(armor_laser_scan, angle_min, "rad"),
  ARMOR_FIELD(armor_laser_scan, angle_max, "rad"),
  ARMOR_FIELD(armor_laser_scan, angle_increment, "rad"),
  ARMOR_FIELD(armor_laser_scan, time_increment, "s"),
  ARMOR_FIELD(armor_laser_scan, scan_time, "s"),
  ARMOR_FIELD(armor_laser_scan, range_min, "m"),
  ARMOR_FIELD(armor_laser_scan, range_max, "m"),
  ARMOR_LIST(armor_laser_scan, intensities, ""),
  ARMOR_LIST(armor_laser_scan, ranges, "m"));

// An uncompressed image.
typedef struct armor_image {
  // System time in seconds of the exposure.
  // Unit: s.
  double stamp;
  // Optical frame of the camera: z ahead, x right, y down.
  armor_string frame;
  // Rows.
  uint32_t height;
  // Columns.
  uint32_t width;
  // Layout of a pixel: `rgb8`, `bgr8`, `mono8`, `mono16`, …
  armor_string encoding;
  // 1 if pixels of more than one byte are big-endian.
  uint8_t is_bigendian;
  // Length of a row in bytes.
  // Unit: B.
  uint32_t step;
  // The rows, top first.
  armor_u8_list data;
} armor_image;
ARMOR_STRUCT(armor_image, "Image",
  ARMOR_FIELD(armor_image, stamp, "s"),
  ARMOR_FIELD(armor_image, frame, ""),
  ARMOR_FIELD(armor_image, height, ""),
  ARMOR_FIELD(armor_image, width, ""),
  ARMOR_FIELD(armor_image, encoding, ""),
  ARMOR_FIELD(armor_image, is_bigendian, ""),
  ARMOR_FIELD(armor_image, step, "B"),
  ARMOR_LIST(armor_image, data, ""));

// A compressed image.
typedef struct armor_compressed_image {
  // System time in seconds of the exposure.
  // Unit: s.
  double stamp;
  // Optical frame of the camera.
  armor_string frame;
  // `jpeg` or `png`.
  armor_string format;
  // The file.
  armor_u8_list data;
} armor_compressed_image;
ARMOR_STRUCT(armor_compressed_image, "CompressedImage",
  ARMOR_FIELD(armor_compressed_image, stamp, "s"),
  ARMOR_FIELD(armor_compressed_image, frame, ""),
  ARMOR_FIELD(armor_compressed_image, format, ""),
  ARMOR_LIST(armor_compressed_image, data, ""));

// Something that was recognized in an image: what it is, how sure that is, and where it is in the image,
// as a rectangle along rows and columns.
typedef struct armor_detection2d {
  // What it is, in the words of the detector: `person`.
  armor_string label;
  // How sure the detector is; its README states the scale.
  double score;
  // Column of the middle, in pixels from the left edge of the image.
  double center_x;
  // Row of the middle, in pixels from the upper edge of the image.
  double center_y;
  // Width in pixels.
  double size_x;
  // Height in pixels.
  double size_y;
} armor_detection2d;
ARMOR_STRUCT(armor_detection2d, "Detection2D",
  ARMOR_FIELD(armor_detection2d, label, ""),
  ARMOR_FIELD(armor_detection2d, score, ""),
  ARMOR_FIELD(armor_detection2d, center_x, ""),
  ARMOR_FIELD(armor_detection2d, center_y, ""),
  ARMOR_FIELD(armor_detection2d, size_x, ""),
  ARMOR_FIELD(armor_detection2d, size_y, ""));

// What was recognized in one image; none if the image was searched and nothing was found.
typedef struct armor_detection2darray {
  // System time in seconds of the exposure of the image.
  // Unit: s.
  double stamp;
  // Optical frame of the camera.
  armor_string frame;
  // Rows of the image.
  uint32_t height;
  // Columns of the image.
  uint32_t width;
  // The surest first.
  ARMOR_LIST_OF(armor_detection2d) detections;
} armor_detection2darray;
ARMOR_STRUCT(armor_detection2darray, "Detection2DArray",
  ARMOR_FIELD(armor_detection2darray, stamp, "s"),
  ARMOR_FIELD(armor_detection2darray, frame, ""),
  ARMOR_FIELD(armor_detection2darray, height, ""),
  ARMOR_FIELD(armor_detection2darray, width, ""),
  ARMOR_NESTED_LIST(armor_detection2darray, detections, armor_detection2d));

// A measurement of an inertial measurement unit.
typedef struct armor_imu {
  // System time in seconds.
  // Unit: s.
  double stamp;
  // Frame of the unit.
  armor_string frame;
  // Its orientation in the world; the covariance's first element is -1 if it has none.
  armor_quaternion orientation;
  // Row-major 3x3 about x, y, z.
  double orientation_covariance[9];
  // Angular velocity.
  // Unit: rad/s.
  armor_vector3 angular_velocity;
  // Row-major 3x3 about x, y, z.
  double angular_velocity_covariance[9];
  // Linear acceleration, gravity included.
  // Unit: m/s2.
  armor_vector3 linear_acceleration;
  // Row-major 3x3 along x, y, z.
  double linear_acceleration_covariance[9];
} armor_imu;
ARMOR_STRUCT(armor_imu, "Imu",
  ARMOR_FIELD(armor_imu, stamp, "s"),
  ARMOR_FIELD(armor_imu, frame, ""),
  ARMOR_NESTED(armor_imu, orientation, armor_quaternion, ""),
  ARMOR_ARRAY(armor_imu, orientation_covariance, ""),
  ARMOR_NESTED(armor_imu, angular_velocity, armor_vector3, "rad/s"),
  ARMOR_ARRAY(armor_imu, angular_velocity_covariance, ""),
  ARMOR_NESTED(armor_imu, linear_acceleration, armor_vector3, "m/s2"),
  ARMOR_ARRAY(armor_imu, linear_acceleration_covariance, ""));

// Kind of a satellite fix.
typedef enum armor_nav_sat_status {
  // No position.
  ARMOR_NAV_SAT_STATUS_NO_FIX,
  // An unaugmented position.
  ARMOR_NAV_SAT_STATUS_FIX,
  // With satellite-based augmentation.
  ARMOR_NAV_SAT_STATUS_SBAS_FIX,
  // With ground-based augmentation.
  ARMOR_NAV_SAT_STATUS_GBAS_FIX,
} armor_nav_sat_status;
ARMOR_ENUM(armor_nav_sat_status, "NavSatStatus", "NoFix", "Fix", "SbasFix", "GbasFix");

// Satellite systems used; the numbers are `sensor_msgs/NavSatStatus`' bits.
typedef struct armor_nav_sat_service {
  // 1 GPS, 2 GLONASS, 4 Compass, 8 Galileo, added up.
  uint16_t bits;
} armor_nav_sat_service;
ARMOR_STRUCT(armor_nav_sat_service, "NavSatService",
  ARMOR_FIELD(armor_nav_sat_service, bits, ""));

// A position from satellites, WGS 84.
typedef struct armor_nav_sat_fix {
  // System time in seconds.
  // Unit: s.
  double stamp;
  // Frame of the antenna.
  armor_string frame;
  // Kind of the fix.
  armor_nav_sat_status status;
  // Systems used.
  armor_nav_sat_service service;
  // Degrees, north positive.
  // Unit: deg.
  double latitude;
  // Degrees, east positive.
  // Unit: deg.
  double longitude;
  // Metres above the ellipsoid; NaN if unknown.
  // Unit: m.
  double altitude;
  // Row-major 3x3 over east, north, up, in m².
  double position_covariance[9];
  // 0 unknown, 1 approximated, 2 diagonal known, 3 known.
  uint8_t position_covariance_type;
} armor_nav_sat_fix;
ARMOR_STRUCT(armor_nav_sat_fix, "NavSatFix",
  ARMOR_FIELD(armor_nav_sat_fix, stamp, "s"),
  ARMOR_FIELD(armor_nav_sat_fix, frame, ""),
  ARMOR_NESTED(armor_nav_sat_fix, status, armor_nav_sat_status, ""),
  ARMOR_NESTED(armor_nav_sat_fix, service, armor_nav_sat_service, ""),
  ARMOR_FIELD(armor_nav_sat_fix, latitude, "deg"),
  ARMOR_FIELD(armor_nav_sat_fix, longitude, "deg"),
  ARMOR_FIELD(armor_nav_sat_fix, altitude, "m"),
  ARMOR_ARRAY(armor_nav_sat_fix, position_covariance, ""),
  ARMOR_FIELD(armor_nav_sat_fix, position_covariance_type, ""));

// State of the power supply.
typedef enum armor_power_supply_status {
  // Not known.
  ARMOR_POWER_SUPPLY_STATUS_UNKNOWN,
  // It is being charged.
  ARMOR_POWER_SUPPLY_STATUS_CHARGING,
  // It is being used.
  ARMOR_POWER_SUPPLY_STATUS_DISCHARGING,
  // It is neither charged nor used.
  ARMOR_POWER_SUPPLY_STATUS_NOT_CHARGING,
  // It is full.
  ARMOR_POWER_SUPPLY_STATUS_FULL,
} armor_power_supply_status;
ARMOR_ENUM(armor_power_supply_status, "PowerSupplyStatus", "Unknown", "Charging", "Discharging", "NotCharging", "Full");

// State of a battery. A number that is not measured is NaN.
typedef struct armor_battery_state {
  // System time in seconds.
  // Unit: s.
  double stamp;
  // Frame, or place, of the battery.
  armor_string frame;
  // Voltage.
  // Unit: V.
  float voltage;
  // Temperature.
  // Unit: degC.
  float temperature;
  // Current; negative when discharging.
  // Unit: A.
  float current;
  // Current charge.
  // Unit: Ah.
  float charge;
  // Charge when last full.
  // Unit: Ah.
  float capacity;
  // Charge by design.
  // Unit: Ah.
  float design_capacity;
  // 0..=1.
  float percentage;
  // State of the power supply.
  armor_power_supply_status power_supply_status;
  // Whether there is one.
  bool present;
} armor_battery_state;
ARMOR_STRUCT(armor_battery_state, "BatteryState",
  ARMOR_FIELD(armor_battery_state, stamp, "s"),
  ARMOR_FIELD(armor_battery_state, frame, ""),
  ARMOR_FIELD(armor_battery_state, voltage, "V"),
  ARMOR_FIELD(armor_battery_state, temperature, "degC"),
  ARMOR_FIELD(armor_battery_state, current, "A"),
  ARMOR_FIELD(armor_battery_state, charge, "Ah"),
  ARMOR_FIELD(armor_battery_state, capacity, "Ah"),
  ARMOR_FIELD(armor_battery_state, design_capacity, "Ah"),
  ARMOR_FIELD(armor_battery_state, percentage, ""),
  ARMOR_NESTED(armor_battery_state, power_supply_status, armor_power_supply_status, ""),
  ARMOR_FIELD(armor_battery_state, present, ""));

// Yes or no.
typedef struct armor_flag {
  // The value.
  bool data;
} armor_flag;
ARMOR_STRUCT(armor_flag, "Flag",
  ARMOR_FIELD(armor_flag, data, ""));

// A number.
typedef struct armor_number {
  // The value.
  double data;
} armor_number;
ARMOR_STRUCT(armor_number, "Number",
  ARMOR_FIELD(armor_number, data, ""));

// Text.
typedef struct armor_text {
  // The value.
  armor_string data;
} armor_text;
ARMOR_STRUCT(armor_text, "Text",
  ARMOR_FIELD(armor_text, data, ""));

// How many.
typedef struct armor_count {
  // The value.
  uint64_t count;
} armor_count;
ARMOR_STRUCT(armor_count, "Count",
  ARMOR_FIELD(armor_count, count, ""));

// One line of a log.
typedef struct armor_log {
  // System time in seconds.
  // Unit: s.
  double stamp;
  // 10 debug, 20 info, 30 warning, 40 error, 50 fatal.
  uint8_t level;
  // The process that logs it.
  armor_string name;
  // The text.
  armor_string msg;
  // Source file.
  armor_string file;
  // Function.
  armor_string function;
  // Line in the file.
  uint32_t line;
} armor_log;
ARMOR_STRUCT(armor_log, "Log",
  ARMOR_FIELD(armor_log, stamp, "s"),
  ARMOR_FIELD(armor_log, level, ""),
  ARMOR_FIELD(armor_log, name, ""),
  ARMOR_FIELD(armor_log, msg, ""),
  ARMOR_FIELD(armor_log, file, ""),
  ARMOR_FIELD(armor_log, function, ""),
  ARMOR_FIELD(armor_log, line, ""));

// How far a component's task has come (our own; ROS has no such message).
// 
// A component whose task takes long may publish it, by convention on an output named `progress`,
// at about once per second and whenever `task` changes (`ProgressPace`). `armor run` shows the
// newest one.
typedef struct armor_progress {
  // System time in seconds.
  // Unit: s.
  double stamp;
  // What is being done, such as `exploring`; empty while no task is active.
  armor_string task;
  // Share of the task that is done, 0 … 1 (no unit); NaN if unknown.
  float fraction;
  // Details for people, such as `84 % explored, 3.2 m to the goal`; may be empty.
  armor_string detail;
} armor_progress;
ARMOR_STRUCT(armor_progress, "Progress",
  ARMOR_FIELD(armor_progress, stamp, "s"),
  ARMOR_FIELD(armor_progress, task, ""),
  ARMOR_FIELD(armor_progress, fraction, ""),
  ARMOR_FIELD(armor_progress, detail, ""));

#endif  // ARMOR_MESSAGES_H
