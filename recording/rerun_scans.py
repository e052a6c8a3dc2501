#!/usr/bin/env python3
"""Converts a recording for Rerun: the file as Rerun itself reads it, and what it does not draw (laser
scans, paths, poses with covariance, odometry), in one .rrd.

Needs `pip install rerun-sdk mcap mcap-ros2-support`.

    python3 rerun_scans.py drive.mcap drive.rrd && rerun drive.rrd
"""

import argparse
import pathlib
import subprocess
import sys
import tempfile

import numpy as np
import rerun as rr
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

# Under these, next to the entity with the message's fields.
DRAWN = "/drawn"


def place(pose):
    position, turn = pose.position, pose.orientation
    return rr.InstancePoses3D(translations=[[position.x, position.y, position.z]],
                              quaternions=[[turn.x, turn.y, turn.z, turn.w]])


def draw_scan(entity, scan):
    ranges = np.array(scan.ranges)
    angles = scan.angle_min + scan.angle_increment * np.arange(len(ranges))
    is_seen = (ranges >= scan.range_min) & (ranges < scan.range_max)
    points = np.stack([ranges * np.cos(angles), ranges * np.sin(angles), 0 * ranges], axis=1)
    rr.log(entity, rr.Points3D(points[is_seen], radii=0.03, colors=[255, 140, 0]))


def draw_path(entity, path):
    places = [it.pose.position for it in path.poses]
    strip = [[it.x, it.y, it.z] for it in places]
    rr.log(entity, rr.LineStrips3D([strip] if strip else [], radii=0.02, colors=[47, 128, 237]))


def draw_pose(entity, message):
    rr.log(entity, place(message.pose.pose))


DRAWINGS = {
    "sensor_msgs/msg/LaserScan": draw_scan,
    "nav_msgs/msg/Path": draw_path,
    "geometry_msgs/msg/PoseWithCovarianceStamped": draw_pose,
    "nav_msgs/msg/Odometry": draw_pose,
}


def draw_messages(recording, drawn):
    """Writes what Rerun does not draw; returns how many messages."""
    count = 0
    rr.save(drawn)
    with open(recording, "rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        topics = [channel.topic for channel in reader.get_summary().channels.values()
                  if reader.get_summary().schemas[channel.schema_id].name in DRAWINGS]
        for schema, channel, message, decoded in reader.iter_decoded_messages(topics=topics):
            # The time lines of Rerun's own reader of MCAP.
            rr.set_time("message_log_time", timestamp=np.datetime64(message.log_time, "ns"))
            entity = f"{channel.topic}{DRAWN}"
            rr.log(entity, rr.CoordinateFrame(decoded.header.frame_id))
            DRAWINGS[schema.name](entity, decoded)
            count += 1
    rr.disconnect()
    return count


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("recording", type=pathlib.Path)
    parser.add_argument("output", type=pathlib.Path)
    options = parser.parse_args()
    name = options.recording.stem
    rerun = [sys.executable, "-m", "rerun"]
    with tempfile.TemporaryDirectory() as folder:
        read, drawn = f"{folder}/read.rrd", f"{folder}/drawn.rrd"
        rr.init(name, recording_id=name)
        count = draw_messages(options.recording, drawn)
        subprocess.run([*rerun, "mcap", "convert", options.recording, "-o", read,
                        "--application-id", name, "--recording-id", name], check=True)
        subprocess.run([*rerun, "rrd", "merge", read, drawn, "-o", options.output], check=True)
    print(f"{options.output}: {count} messages drawn beyond what Rerun draws itself")


if __name__ == "__main__":
    main()
