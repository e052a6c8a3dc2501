#!/usr/bin/env python3
"""Converts a recording for Rerun: the file as Rerun itself reads it, and what it does not draw (laser
scans, paths, poses with covariance, odometry; the fixed frames of the system's file), in one .rrd, with a
view of the map, the camera and the velocities.

Needs `pip install rerun-sdk mcap mcap-ros2-support`.

    python3 rerun_scans.py drive.mcap drive.rrd && rerun drive.rrd
"""

import argparse
import math
import pathlib
import re
import subprocess
import sys
import tempfile
import xml.etree.ElementTree

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
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


def read_length(text):
    """A length or an angle of the file, in metres or radians."""
    number, unit = re.fullmatch(r"\s*([-+.0-9eE]+)\s*([a-zµ°]*)\s*", text).groups()
    return float(number) * {"": 1, "m": 1, "cm": 0.01, "mm": 0.001, "rad": 1,
                            "deg": math.pi / 180, "°": math.pi / 180}[unit]


def draw_frames(reader):
    """The fixed frames of the files in the recording; returns how many."""
    count = 0
    for file in reader.iter_attachments():
        if not file.name.endswith(".xml"):
            continue
        for frame in xml.etree.ElementTree.fromstring(file.data).iter("frame"):
            x, y, z, roll, pitch, yaw = (read_length(frame.get(name, "0"))
                                         for name in ("x", "y", "z", "roll", "pitch", "yaw"))
            (sr, sp, sy), (cr, cp, cy) = ([turn(it / 2) for it in (roll, pitch, yaw)]
                                          for turn in (math.sin, math.cos))
            quaternion = [sr * cp * cy - cr * sp * sy, cr * sp * cy + sr * cp * sy,
                          cr * cp * sy - sr * sp * cy, cr * cp * cy + sr * sp * sy]
            rr.log(f"frames/{frame.get('name')}", rr.Transform3D(
                translation=[x, y, z], quaternion=quaternion, parent_frame=frame.get("in"),
                child_frame=frame.get("name")), static=True)
            count += 1
    return count


def make_view(schemas):
    """The map with all that is on it, and the images."""
    robot = rrb.Spatial3DView(name="Robot", spatial_information=rrb.SpatialInformation("map"),
                              contents=["+ /**", "- /**/camera/**", *(f"- /{it}/**" for it, name in
                                        schemas.items() if "Image" in name or "NavSatFix" in name)])
    images = [rrb.Spatial2DView(name=it, origin=f"/{it}") for it, name in schemas.items()
              if "CompressedImage" in name]
    return rrb.Horizontal(robot, *images, column_shares=[3] + [1] * len(images))


def draw_messages(recording, drawn):
    """Writes what Rerun does not draw; returns how many messages."""
    count = 0
    with open(recording, "rb") as file:
        summary = make_reader(file).get_summary()
        schemas = {it.topic: summary.schemas[it.schema_id].name for it in summary.channels.values()}
    rr.save(drawn, default_blueprint=make_view(schemas))
    with open(recording, "rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        draw_frames(reader)
        topics = [topic for topic, name in schemas.items() if name in DRAWINGS]
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
