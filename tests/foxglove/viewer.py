"""A viewer for Armor's component `foxglove`, as far as its tests need one: PyPI's `websockets`, and the
decoder of `mcap-ros2-support` for the data."""

import json
import struct
import time

from mcap.records import Schema
from mcap_ros2.decoder import DecoderFactory
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

PROTOCOL = "foxglove.sdk.v1"


class Viewer:
    """A connection, and everything that it has received."""

    def __init__(self, url, protocols=(PROTOCOL,), **options):
        self.socket = connect(url, subprotocols=list(protocols), max_size=None, **options)
        self.channels, self.texts, self.times, self.responses = {}, [], [], []
        self.messages, self.subscriptions, self.parameters = {}, {}, {}
        self.graph = {"published": {}, "subscribed": {}, "services": {}}
        self.services, self.info, self.decoders, self.statuses = {}, None, {}, []
        self.next_subscription, self.bytes = 1, 0
        self.wait_for(lambda: self.info and self.services and self.channels, "the announcements")

    def send(self, request):
        self.socket.send(json.dumps(request))

    def receive(self, timeout):
        """Handles one message; returns whether one came in time."""
        try:
            message = self.socket.recv(timeout=timeout)
        except TimeoutError:
            return False
        if isinstance(message, str):
            self.handle_text(json.loads(message))
        else:
            self.handle_binary(message)
        return True

    def receive_for(self, seconds):
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0:
            self.receive(left)

    def wait_for(self, condition, what, seconds=20):
        end = time.monotonic() + seconds
        while not (found := condition()):
            left = end - time.monotonic()
            if left <= 0:
                raise AssertionError(f"{what} did not happen; statuses: {self.statuses[-3:]}")
            self.receive(left)
        return found

    def handle_text(self, text):
        self.texts.append(text)
        match text["op"]:
            case "serverInfo":
                self.info = text
            case "advertise":
                self.channels |= {channel["topic"]: channel for channel in text["channels"]}
            case "unadvertise":
                gone = set(text["channelIds"])
                self.channels = {t: c for t, c in self.channels.items() if c["id"] not in gone}
            case "advertiseServices":
                self.services |= {service["name"]: service for service in text["services"]}
            case "parameterValues":
                self.parameters |= {it["name"]: it.get("value") for it in text["parameters"]}
            case "status":
                self.statuses.append(text["message"])
            case "serviceCallFailure":
                self.responses.append((text["callId"], None, text["message"]))
            case "connectionGraphUpdate":
                parts = [("publishedTopics", "published", "publisherIds"),
                         ("subscribedTopics", "subscribed", "subscriberIds"),
                         ("advertisedServices", "services", "providerIds")]
                for key, part, ids in parts:
                    self.graph[part] |= {it["name"]: it[ids] for it in text[key]}

    def handle_binary(self, frame):
        self.bytes += len(frame)
        match frame[0]:
            case 1:
                subscription, stamp_ns = struct.unpack_from("<IQ", frame, 1)
                topic = self.subscriptions.get(subscription)
                if topic:
                    self.messages.setdefault(topic, []).append((stamp_ns, frame[13:]))
            case 2:
                self.times.append(struct.unpack_from("<Q", frame, 1)[0])
            case 3:
                service, call, length = struct.unpack_from("<III", frame, 1)
                encoding = frame[13:13 + length].decode()
                self.responses.append((call, encoding, frame[13 + length:]))

    def subscribe(self, *topics):
        wanted = []
        for topic in topics:
            channel = self.wait_for(lambda t=topic: self.channels.get(t), f"the channel {topic}")
            self.subscriptions[self.next_subscription] = topic
            wanted.append({"id": self.next_subscription, "channelId": channel["id"]})
            self.next_subscription += 1
        self.send({"op": "subscribe", "subscriptions": wanted})

    def decode(self, topic, payload):
        channel = self.channels[topic]
        if topic not in self.decoders:
            schema = Schema(id=1, name=channel["schemaName"], encoding=channel["schemaEncoding"],
                            data=channel["schema"].encode())
            self.decoders[topic] = DecoderFactory().decoder_for(channel["encoding"], schema)
        return self.decoders[topic](payload)

    def last(self, topic):
        return self.decode(topic, self.messages[topic][-1][1])

    def advertise(self, number, topic, schema, encoding="cdr"):
        channel = {"id": number, "topic": topic, "encoding": encoding, "schemaName": schema}
        self.send({"op": "advertise", "channels": [channel]})

    def publish(self, number, payload):
        self.socket.send(struct.pack("<BI", 1, number) + payload)

    def call(self, name, number, payload, encoding="json"):
        """Calls a service; returns its response, or the reason of its failure."""
        head = struct.pack("<BIII", 2, self.services[name]["id"], number, len(encoding))
        self.socket.send(head + encoding.encode() + payload)
        found = lambda: [it for it in self.responses if it[0] == number]
        _, used, response = self.wait_for(found, f"the response of {name}")[0]
        return json.loads(response) if used == "json" else response


def twist(forward, turn):
    """A `geometry_msgs/msg/Twist` in CDR."""
    return b"\0\1\0\0" + struct.pack("<6d", forward, 0, 0, 0, 0, turn)


def boolean(value):
    """A `std_msgs/msg/Bool` in CDR."""
    return b"\0\1\0\0" + bytes([value])


__all__ = ["ConnectionClosed", "PROTOCOL", "Viewer", "boolean", "twist"]
