"""Reads a recording as the programs of ROS 2 do: with their decoders from PyPI.

    pip install mcap mcap-ros2-support rosbags
    python3 read_recording.py RECORDING [COUNTS]

COUNTS is the output of `armor bag info --format json`: the counts must be the same.
"""

import collections
import json
import sys

from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.typesys import Stores, get_typestore


def main():
    counts = collections.Counter()
    by_ros = collections.Counter()
    ros = get_typestore(Stores.ROS2_HUMBLE)
    with open(sys.argv[1], "rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        for schema, channel, message, decoded in reader.iter_decoded_messages():
            counts[channel.topic] += 1
            # By the definitions that ROS has, not by those in the file.
            if schema.name in ros.types:
                ros.deserialize_cdr(message.data, schema.name)
                by_ros[schema.name] += 1
            if schema.name == "sensor_msgs/msg/LaserScan":
                assert decoded.header.frame_id and len(decoded.ranges) > 1, decoded
    heads = counts.pop("armor.heads")
    assert heads == sum(counts.values()) > 0, (heads, counts)
    assert len(by_ros) > 5, f"only {by_ros} have a type of ROS"
    if len(sys.argv) > 2:
        with open(sys.argv[2], encoding="utf-8") as file:
            info = json.load(file)
        assert info["complete"], info
        expected = {output["data"]: output["messages"] for output in info["outputs"]}
        assert expected == dict(counts), (expected, counts)
    print(f"{heads} messages of {len(counts)} outputs, {sum(by_ros.values())} of them by ROS's own types")


main()
