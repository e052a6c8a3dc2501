"""Reads a bag that `armor bag convert DRIVE.mcap DRIVE.bag` has written, as ROS 1 does: with PyPI's
`rosbags`, by its index.

    pip install rosbags
    python3 read_bag.py BAG [COUNTS]

Every message is decoded by the definition in the bag. The types that ROS 1 has must have its checksums, by
which its subscribers know them. COUNTS is the output of `armor bag info --format json` of the recording.
"""

import collections
import json
import sys
from pathlib import Path

from rosbags.rosbag1 import Reader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore


def main():
    ros = get_typestore(Stores.ROS1_NOETIC)
    counts, by_ros = collections.Counter(), collections.Counter()
    with Reader(Path(sys.argv[1])) as reader:
        stores = {}
        for connection in reader.connections:
            own = get_typestore(Stores.EMPTY)
            own.register(get_types_from_msg(connection.msgdef.data, connection.msgtype))
            stores[connection.id] = own
            if connection.msgtype in ros.types:
                _, expected = ros.generate_msgdef(connection.msgtype, ros_version=1)
                assert connection.digest == expected, (connection.msgtype, connection.digest, expected)
        last = 0
        for connection, time, data in reader.messages():
            assert time >= last, "the index is in the order of the times"
            last = time
            message = stores[connection.id].deserialize_ros1(data, connection.msgtype)
            counts[connection.topic] += 1
            by_ros[connection.msgtype] += connection.msgtype in ros.types
            if connection.msgtype == "sensor_msgs/msg/LaserScan":
                assert message.header.frame_id and len(message.ranges) > 1, message
    assert sum(count > 0 for count in by_ros.values()) > 5, by_ros
    if len(sys.argv) > 2:
        with open(sys.argv[2], encoding="utf-8") as file:
            outputs = json.load(file)["outputs"]
        expected = {"/" + it["data"].replace(".", "/").replace("-", "_"): it["messages"] for it in outputs}
        assert expected == dict(counts), (expected, counts)
    print(f"{sum(counts.values())} messages of {len(counts)} topics, "
          f"{sum(by_ros.values())} of them of types of ROS 1")


main()
