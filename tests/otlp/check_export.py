"""Checks what `armor trace --otlp` sends with the definitions of OpenTelemetry itself.

    pip install opentelemetry-proto
    armor run missions/office.xml --headless &
    python3 check_export.py ARMOR [DATA]

It is a collector for a few seconds: each request must be an `ExportTraceServiceRequest` in the JSON
mapping of Protocol Buffers, without a field that this does not know. OTLP deviates from that mapping in one
point: ids are hexadecimal digits, not base64.
"""

import base64
import http.server
import json
import subprocess
import sys
import threading

from google.protobuf import json_format
from opentelemetry.proto.collector.trace.v1.trace_service_pb2 import ExportTraceServiceRequest

IDS = {"traceId": 16, "spanId": 8, "parentSpanId": 8}
SECONDS = 5

requests = []


def with_base64(value):
    if isinstance(value, list):
        return [with_base64(it) for it in value]
    if not isinstance(value, dict):
        return value
    fields = {}
    for name, inner in value.items():
        if name in IDS:
            number = bytes.fromhex(inner)
            assert len(number) in (0, IDS[name]), (name, inner)
            fields[name] = base64.b64encode(number).decode()
        else:
            fields[name] = with_base64(inner)
    return fields


class Collector(http.server.BaseHTTPRequestHandler):
    def do_POST(self):
        body = self.rfile.read(int(self.headers["Content-Length"]))
        requests.append((self.path, self.headers["Content-Type"], body))
        self.send_response(200)
        self.send_header("Content-Type", "application/json")
        self.end_headers()
        self.wfile.write(b"{}")

    def log_message(self, *_):
        pass


def main():
    armor, *data = sys.argv[1:]
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Collector)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    address = f"http://127.0.0.1:{server.server_port}"
    subprocess.run([armor, "trace", *data, "--otlp", address, "--for", f"{SECONDS}s"], check=True,
                   stdout=subprocess.DEVNULL)
    spans, services, parents = {}, set(), 0
    for path, content_type, body in requests:
        assert path == "/v1/traces" and content_type == "application/json", (path, content_type)
        parsed = json_format.ParseDict(with_base64(json.loads(body)), ExportTraceServiceRequest())
        for resource in parsed.resource_spans:
            attributes = {it.key: it.value.string_value for it in resource.resource.attributes}
            services.add(attributes["service.name"])
            for scope in resource.scope_spans:
                for span in scope.spans:
                    assert span.name and len(span.trace_id) == 16 and len(span.span_id) == 8, span
                    assert 0 < span.start_time_unix_nano <= span.end_time_unix_nano, span
                    spans[span.trace_id, span.span_id] = span
    for (trace, _), span in spans.items():
        if span.parent_span_id:
            # The first second may have begun within a trace.
            parents += (trace, span.parent_span_id) in spans
    assert len(spans) > 20 and len(services) > 2 and parents > 10, (len(spans), services, parents)
    print(f"{len(requests)} requests, {len(spans)} spans of {len(services)} services, "
          f"{parents} with their parents")


main()
