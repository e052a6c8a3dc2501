#!/usr/bin/env python3
"""Subscribes to data of a running Armor system: written from ../protocol.md alone.

    python3 subscribe.py laser.scan [--count 5] [--registry 127.0.0.1:7411]

For each message: sequence, losses before it, length of the payload, and its value as JSON.
"""
import argparse, base64, json, math, os, random, re, socket, struct, sys, threading

HELLO, WELCOME, REFUSAL, DATA, BEAT, _, _, CONTROL = range(1, 9)
NUMBERS = {"u8": "B", "i8": "b", "u16": "H", "i16": "h", "u32": "I", "i32": "i", "u64": "Q",
           "i64": "q", "f32": "f", "f64": "d"}
REASON = ("Refusal{code:RefusalCode<Version,WrongInstance,UnknownData,TypeMismatch,DuplicateName,"
          "Limit,WrongPurpose,Malformed>,text:string}")
REPLY = ("Reply<Provided{request:u64},Refused{request:u64,refusal:" + REASON + "},Found{request:u64,"
         "entry:DataEntry{data:string,type_name:string,schema:string,latched:bool},provider:"
         "ComponentEntry{name:string,kind:string,instance:u64,pid:u32,host:string,endpoint:string}}>")
WELCOME_BODY = "Welcome{name:string,instance:u64,schema:string}"


def parse(tokens):
    """Schema text, split into names, units and signs, to a tree of tuples."""
    token = tokens.pop(0)
    if token == "?":
        return ("option", parse(tokens))
    if token == "[":
        item, end = parse(tokens), tokens.pop(0)
        count = int(tokens.pop(0)) if end == ";" else None
        return ("list", item, count, count and tokens.pop(0))
    if tokens and tokens[0] == "{":
        return ("struct", fields(tokens))
    if tokens and tokens[0] == "<":
        variants = []
        while tokens.pop(0) != ">":
            name = tokens.pop(0)
            variants.append((name, fields(tokens) if tokens[0] == "{" else []))
        return ("enum", variants)
    return token


def fields(tokens):
    found = []
    while tokens.pop(0) != "}":  # "{" or "," before each field
        if tokens[0] == "}":
            continue
        name, _ = tokens.pop(0), tokens.pop(0)
        found.append((name, parse(tokens)))
        if tokens[0].startswith("("):
            tokens.pop(0)
    return found


def schema(text):
    return parse(re.findall(r"[\w/-]+|\([^)]*\)|.", text))


def shortest(number):
    """The number with the fewest digits that is the same as an f32."""
    for digits in range(1, 10):
        short = float(f"{number:.{digits}g}")
        if abs(short) < 3.4028235e38 and struct.pack("<f", short) == struct.pack("<f", number):
            return short
    return number


class Reader:
    def __init__(self, payload):
        self.payload, self.at = payload, 0

    def take(self, form):
        (value,) = struct.unpack_from("<" + form, self.payload, self.at)
        self.at += struct.calcsize("<" + form)
        return value

    def value(self, kind):
        if isinstance(kind, str) and kind in NUMBERS:
            number = self.take(NUMBERS[kind])
            if isinstance(number, float) and not math.isfinite(number):
                return "NaN" if math.isnan(number) else "Infinity" if number > 0 else "-Infinity"
            return shortest(number) if kind == "f32" else number
        if kind == "bool":
            return bool(self.take("B"))
        if kind == "string":
            return self.take(f"{self.take('Q')}s").decode()
        if kind[0] == "option":
            return self.value(kind[1]) if self.take("B") else None
        if kind[0] == "list" and kind[1] == "u8" and kind[2] is None:
            return base64.b64encode(self.take(f"{self.take('Q')}s")).decode()
        if kind[0] == "list":
            count = self.take("Q") if kind[2] is None else kind[2]
            return [self.value(kind[1]) for _ in range(count)]
        if kind[0] == "struct":
            return {name: self.value(inner) for name, inner in kind[1]}
        name, inner = kind[1][self.take("I")]
        return {name: {field: self.value(of) for field, of in inner}} if inner else name


def text(value):
    return struct.pack("<Q", len(value.encode())) + value.encode()


class Connection:
    """Connected and welcomed, beating until it is closed."""

    def __init__(self, address, purpose):
        host, port = address.rsplit(":", 1)
        try:
            self.socket = socket.create_connection((host.strip("[]"), int(port)), timeout=2)
        except OSError as error:
            sys.exit(f"cannot connect to {address}: {error}")
        if self.socket.getsockname() == self.socket.getpeername():
            sys.exit(f"no process listens at {address}")
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.socket.settimeout(1.75)
        self.writing, self.closed = threading.Lock(), threading.Event()
        hello = b"ARMR" + struct.pack("<H", 4) + text(f"subscribe.py {os.getpid()}")
        self.send(HELLO, hello + struct.pack("<Q", random.getrandbits(64) | 1) + purpose + b"\0")
        kind, body = self.receive()
        if kind == REFUSAL:
            sys.exit(f"{address} refuses: {Reader(body).value(schema(REASON))['text']}")
        self.welcome = Reader(body).value(schema(WELCOME_BODY))
        threading.Thread(target=self.beat, daemon=True).start()

    def beat(self):
        while not self.closed.wait(0.5):
            try:
                self.send(BEAT)
            except OSError:
                return  # the next receive() fails too

    def send(self, kind, body=b""):
        with self.writing:
            self.socket.sendall(struct.pack("<IBBH", len(body), kind, 0, 0) + body)

    def bytes(self, length):
        found = bytearray()
        while len(found) < length:
            try:
                piece = self.socket.recv(min(length - len(found), 1 << 20))
            except TimeoutError:
                sys.exit("the other end fell silent")
            if not piece:
                sys.exit("the other end closed the connection")
            found += piece
        return bytes(found)

    def receive(self):
        """Kind and body of the next frame that is no beat; the flags are kept aside."""
        while True:
            length, kind, self.flags, reserved = struct.unpack("<IBBH", self.bytes(8))
            if not HELLO <= kind <= CONTROL or length > (64 << 20) + 24 or reserved:
                sys.exit("this is not Armor's protocol")
            body = self.bytes(length)
            if kind != BEAT:
                return kind, body

    def close(self):
        self.closed.set()
        self.socket.close()


def main():
    arguments = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    arguments.add_argument("data", help="component.output")
    arguments.add_argument("--count", type=int, default=5)
    arguments.add_argument("--registry", default=os.environ.get("ARMOR_REGISTRY", "127.0.0.1:7411"))
    options = arguments.parse_args()

    registry = Connection(options.registry, struct.pack("<IB", 0, 0))  # Registry, no entry
    lookup = struct.pack("<IQ", 2, 1) + text(options.data) + text("") + b"\x01"  # any schema, wait
    registry.send(CONTROL, lookup)
    (variant, found), = Reader(registry.receive()[1]).value(schema(REPLY)).items()
    if variant != "Found":
        sys.exit(found["refusal"]["text"])
    registry.close()

    provider = found["provider"]
    request = text(options.data) + struct.pack("<Q", provider["instance"]) + text("")
    request += struct.pack("<QIIBIIB", 0, 0, 0, 0, 1, 0, 0)  # any hash, keep latest, sleep, frames
    link = Connection(provider["endpoint"], struct.pack("<I", 2) + request)
    layout, last = schema(link.welcome["schema"]), None
    print(f"{options.data}: {found['entry']['type_name']} from {provider['name']}"
          f" (process {provider['pid']} on {provider['host']})", file=sys.stderr)
    for _ in range(options.count):
        kind, body = link.receive()
        sequence, stamp_s, _ = struct.unpack_from("<QdQ", body)
        lost = 0 if last is None or link.flags & 1 else sequence - last - 1
        last, reader = sequence, Reader(body[24:])
        value = json.dumps(reader.value(layout), ensure_ascii=False)
        assert kind == DATA and reader.at == len(body) - 24, "the payload is not of its schema"
        print(f"{sequence} lost {lost} at {stamp_s:.6f} s, {len(body) - 24} bytes: {value}", flush=True)


if __name__ == "__main__":
    main()
