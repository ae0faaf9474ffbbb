"""The program under test that a Python function is behind: it hands each call on to the process that has the function.

    relay.py SOCKET {scene} {output}
    relay.py SOCKET --capabilities

It imports nothing of rayproof, so that a call costs no more than an interpreter without site packages.
"""

import json
import socket
import sys

UNSUPPORTED = 77  # of docs/protocol.md

if __name__ == "__main__":
    place, *words = sys.argv[1:]
    with socket.socket(socket.AF_UNIX) as end:
        end.connect(place)
        end.sendall(json.dumps(words).encode() + b"\n")
        told = b"".join(iter(lambda: end.recv(65536), b""))
    answer = json.loads(told or b'{"error": "the process that has the function has ended"}')
    if "capabilities" in answer:
        sys.stdout.write(json.dumps(answer["capabilities"]))
    elif "unsupported" in answer:
        sys.stdout.write(answer["unsupported"])
        sys.exit(UNSUPPORTED)
    elif "error" in answer:
        sys.stderr.write(answer["error"])
        sys.exit(1)
