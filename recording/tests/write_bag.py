"""Writes bags of ROS 1 with PyPI's `rosbags`, one for each compression of its chunks.

    pip install rosbags
    python3 write_bag.py FOLDER

`armor bag convert FOLDER/NAME.bag NAME.mcap` reads 30 messages of each: scans, odometry and transforms.
"""

import sys
from pathlib import Path

import numpy as np
from rosbags.rosbag1 import Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore


def main():
    folder = Path(sys.argv[1])
    store = get_typestore(Stores.ROS1_NOETIC)
    definition = "geometry_msgs/TransformStamped[] transforms"
    store.register(get_types_from_msg(definition, "tf2_msgs/msg/TFMessage"))
    types = store.types
    time = types["builtin_interfaces/msg/Time"]
    header = types["std_msgs/msg/Header"]
    vector = types["geometry_msgs/msg/Vector3"]
    point = types["geometry_msgs/msg/Point"]
    quaternion = types["geometry_msgs/msg/Quaternion"]

    def make_header(number, frame):
        return header(seq=number, stamp=time(sec=100 + number, nanosec=250_000_000), frame_id=frame)

    def make_scan(number):
        return types["sensor_msgs/msg/LaserScan"](
            header=make_header(number, "laser"), angle_min=-1.0, angle_max=1.0, angle_increment=0.5,
            time_increment=0.0, scan_time=0.1, range_min=0.1, range_max=30.0,
            ranges=np.array([1.0, 2.0, 3.0, 4.0, number], dtype=np.float32),
            intensities=np.array([], dtype=np.float32))

    def make_odometry(number):
        pose = types["geometry_msgs/msg/Pose"](
            position=point(x=float(number), y=2.0, z=3.0), orientation=quaternion(x=0.0, y=0.0, z=0.0, w=1.0))
        twist = types["geometry_msgs/msg/Twist"](
            linear=vector(x=0.5, y=0.0, z=0.0), angular=vector(x=0.0, y=0.0, z=0.25))
        covariance = np.arange(36, dtype=np.float64)
        return types["nav_msgs/msg/Odometry"](
            header=make_header(number, "odom"), child_frame_id="base_link",
            pose=types["geometry_msgs/msg/PoseWithCovariance"](pose=pose, covariance=covariance),
            twist=types["geometry_msgs/msg/TwistWithCovariance"](twist=twist, covariance=covariance))

    def make_transforms(number):
        transform = types["geometry_msgs/msg/Transform"](
            translation=vector(x=0.1, y=0.0, z=float(number)), rotation=quaternion(x=0.0, y=0.0, z=0.0, w=1.0))
        stamped = types["geometry_msgs/msg/TransformStamped"](
            header=make_header(number, "odom"), child_frame_id="base_link", transform=transform)
        return types["tf2_msgs/msg/TFMessage"](transforms=[stamped])

    for name, compression in [
        ("none", None), ("bz2", Writer.CompressionFormat.BZ2), ("lz4", Writer.CompressionFormat.LZ4),
    ]:
        with_format = Writer(folder / f"{name}.bag")
        if compression is not None:
            with_format.set_compression(compression)
        with with_format as writer:
            for topic, ros_type, make in [
                ("/robot/scan", "sensor_msgs/msg/LaserScan", make_scan),
                ("/odom", "nav_msgs/msg/Odometry", make_odometry),
                ("/tf", "tf2_msgs/msg/TFMessage", make_transforms),
            ]:
                connection = writer.add_connection(topic, ros_type, typestore=store)
                for number in range(10):
                    data = store.serialize_ros1(make(number), ros_type)
                    writer.write(connection, (100 + number) * 10**9, data)


main()
