"""The writers of PyPI's `mcap` and `rosbags` with the messages of the example `recording_figures`.

    pip install mcap rosbags
    python3 bench/recording_peers.py FOLDER

16,000 messages of 100 kB from 20 topics, 1.6 GB, as fast as each writes them. What is written is
removed.
"""

import os
import resource
import shutil
import sys
import time
from pathlib import Path

MESSAGES = 16_000
TOPICS = 20
LENGTH = 100_000
DATA = bytes(LENGTH)


def measure(name, path, write):
    used = resource.getrusage(resource.RUSAGE_SELF)
    begun = time.monotonic()
    write(path)
    taken = time.monotonic() - begun
    now = resource.getrusage(resource.RUSAGE_SELF)
    cpu = now.ru_utime + now.ru_stime - used.ru_utime - used.ru_stime
    rate = MESSAGES * LENGTH / taken / 1e6
    print(f"{name}: {rate:.0f} MB/s, {cpu:.2f} s of processor time", flush=True)
    shutil.rmtree(path) if path.is_dir() else path.unlink()


def write_mcap(path):
    from mcap.writer import CompressionType, Writer

    with open(path, "wb") as file:
        writer = Writer(file, chunk_size=1 << 20, compression=CompressionType.NONE)
        writer.start()
        schema = writer.register_schema("sensor_msgs/msg/CompressedImage", "ros2msg", b"")
        channels = [writer.register_channel(f"image{topic}", "cdr", schema) for topic in range(TOPICS)]
        for number in range(MESSAGES):
            writer.add_message(channels[number % TOPICS], number * 500_000, DATA, number * 500_000)
        writer.finish()
        file.flush()
        os.fsync(file.fileno())


def write_rosbag2(path):
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    with Writer(path, version=9, storage_plugin=StoragePlugin.SQLITE3) as writer:
        kind = "sensor_msgs/msg/CompressedImage"
        topics = [writer.add_connection(f"/image{topic}", kind, typestore=store) for topic in range(TOPICS)]
        for number in range(MESSAGES):
            writer.write(topics[number % TOPICS], number * 500_000, DATA)


def write_rosbag1(path):
    from rosbags.rosbag1 import Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC)
    with Writer(path) as writer:
        kind = "sensor_msgs/msg/CompressedImage"
        topics = [writer.add_connection(f"/image{topic}", kind, typestore=store) for topic in range(TOPICS)]
        for number in range(MESSAGES):
            writer.write(topics[number % TOPICS], number * 500_000, DATA)


folder = Path(sys.argv[1])
measure("mcap", folder / "peer.mcap", write_mcap)
measure("rosbags, SQLite of ROS 2", folder / "peer-ros2", write_rosbag2)
measure("rosbags, bag of ROS 1", folder / "peer.bag", write_rosbag1)
