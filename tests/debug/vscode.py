"""An editor as Visual Studio Code is one: its messages, at the other end of an adapter's pipes or socket."""

import json
import re
import sys
from pathlib import Path

COMMAND = str(Path(sys.executable).with_name("tmcm34x"))


class Client:
    """An editor at the other end of two file objects."""

    def __init__(self, reader, writer):
        self.reader, self.writer = reader, writer
        self.seq = 0
        self.waiting = []

    def send(self, command, **arguments):
        self.seq += 1
        message = {"seq": self.seq, "type": "request", "command": command, "arguments": arguments}
        body = json.dumps(message).encode()
        self.writer.write(b"Content-Length: %d\r\n\r\n" % len(body) + body)
        self.writer.flush()
        return self.seq

    def next(self):
        length = None
        while (line := self.reader.readline().strip()) or length is None:
            assert line, "the adapter has hung up"
            length = int(re.fullmatch(rb"Content-Length: (\d+)", line)[1])
        return json.loads(self.reader.read(length))

    def ask(self, command, **arguments):
        seq = self.send(command, **arguments)
        while (message := self.next()).get("request_seq") != seq:
            self.waiting.append(message)
        return message

    def do(self, command, **arguments):
        response = self.ask(command, **arguments)
        assert response["success"], response
        return response.get("body")

    def event(self, name):
        """The next event of this name, whatever else comes before."""
        while True:
            message = self.waiting.pop(0) if self.waiting else self.next()
            if message.get("event") == name:
                return message["body"]


VSCODE = {
    "clientID": "vscode", "clientName": "Visual Studio Code", "adapterID": "tmcl", "pathFormat": "path",
    "linesStartAt1": True, "columnsStartAt1": True, "supportsVariableType": True, "supportsVariablePaging": True,
    "supportsRunInTerminalRequest": True, "locale": "en", "supportsProgressReporting": True,
    "supportsInvalidatedEvent": True, "supportsMemoryReferences": True,
    "supportsArgsCanBeInterpretedByShell": True, "supportsMemoryEvent": True,
    "supportsStartDebuggingRequest": True, "supportsANSIStyling": True,
}  # fmt: skip
"""What Visual Studio Code 1.139 says of itself."""


def held(client, reason):
    """The frames and scopes that Visual Studio Code asks for at each stop."""
    assert client.event("stopped")["reason"] == reason
    assert client.do("threads")["threads"][0]["id"] == 1
    top = client.do("stackTrace", threadId=1, startFrame=0, levels=1)
    (frame,) = top["stackFrames"]
    rest = client.do("stackTrace", threadId=1, startFrame=1, levels=19)["stackFrames"]
    assert top["totalFrames"] == 1 + len(rest)
    scopes = client.do("scopes", frameId=frame["id"])["scopes"]
    first = client.do("variables", variablesReference=scopes[0]["variablesReference"])["variables"]
    return [frame["line"], *(f["line"] for f in rest)], scopes[0]["variablesReference"], first
