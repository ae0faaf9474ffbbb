"""A small program that passes requests on by a socket to the process that has the Python function under test.

    relay.py SOCKET

It imports nothing of rayproof, so that its start costs no more than an interpreter without site packages.
"""

import json
import socket
import sys

if __name__ == "__main__":
    for line in sys.stdin:
        try:
            with socket.socket(socket.AF_UNIX) as end:
                end.connect(sys.argv[1])
                end.sendall(line.encode())
                answer = b"".join(iter(lambda: end.recv(65536), b"")).decode()
        except OSError:
            answer = ""
        gone = {"id": json.loads(line)["id"], "error": "the process that has the function has ended"}
        told = json.loads(answer) if answer else gone
        sys.stderr.write(told.pop("trace", ""))
        sys.stdout.write(f"{json.dumps(told)}\n")
        sys.stdout.flush()
