"""Client of `palpate serve`: one file, Python 3.8 or newer, no dependency.

    from palpate import Palpate

    with Palpate(token="...") as palpate:           # the token that `palpate serve` printed
        print(palpate.grasp(object="lemon")["verdict"]["class"])
        print(palpate.advise()["advice"]["text"])

`palpate help control` lists all requests. `python palpate.py --grasps 50` grasps, labels and records unattended.
"""

import argparse
import json
import os
import queue
import socket
import subprocess
import tempfile
import threading
import time

MOVES_AIR = ("grasp", "close", "pressure")


class PalpateError(Exception):
    """A request that was refused; `field` names what is wrong with it, or is None."""

    def __init__(self, text, field=None):
        super().__init__(f"{field}: {text}" if field else text)
        self.field = field


class Palpate:
    """A connection. Requests may come from several threads: `vent` does not wait for a `grasp` to end."""

    def __init__(self, port=4747, token=None, token_file=None):
        try:
            connection = socket.create_connection(("127.0.0.1", port))
        except ConnectionRefusedError:
            raise PalpateError(f"no `palpate serve` on 127.0.0.1:{port}; start it") from None
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._close = lambda: connection.shutdown(socket.SHUT_RDWR)
        self._use(connection.makefile("rb"), connection.makefile("wb"), token, token_file)

    @classmethod
    def start(cls, *arguments, program="palpate"):
        """Starts `palpate serve --stdio` with these arguments, and connects to it."""
        self, token_file = cls.__new__(cls), os.path.join(tempfile.mkdtemp(), "token.txt")
        command = [program, "serve", "--stdio", "--token", token_file, *arguments]
        process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE)

        def close():
            process.stdin.close()
            process.wait()

        self._close = close
        self._use(process.stdout, process.stdin, None, token_file)
        self.recognise()  # answers once it serves
        with open(token_file, encoding="utf-8") as file:
            self._token = file.read().strip()
        return self

    def _use(self, reader, writer, token, token_file):
        if token is None and token_file and os.path.exists(token_file):
            with open(token_file, encoding="utf-8") as file:
                token = file.read().strip()
        self._reader, self._writer, self._token = reader, writer, token
        self._lock, self._waiting, self._number = threading.Lock(), {}, 0
        self._events = queue.Queue()
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self):
        for line in self._reader:
            message = json.loads(line)
            waiting = self._waiting.pop(message["id"], None) if message.get("id") is not None else None
            (waiting or self._events).put(message)
        with self._lock:
            for waiting in [*self._waiting.values(), self._events]:
                waiting.put(None)

    def request(self, request, wait=600.0, **fields):
        """Sends a request, waits for its answer (s), and returns it; fields that are None are left out."""
        answer = queue.Queue()
        with self._lock:
            self._number += 1
            message = {"id": self._number, "request": request}
            message.update({name: value for name, value in fields.items() if value is not None})
            if request in MOVES_AIR:
                message["token"] = self._token
            self._waiting[self._number] = answer
            self._writer.write(json.dumps(message).encode() + b"\n")
            self._writer.flush()
        try:
            message = answer.get(timeout=wait)
        except queue.Empty:
            raise PalpateError(f"no answer to {request} within {wait} s") from None
        if message is None:
            raise PalpateError("the server has closed the connection")
        if "error" in message:
            raise PalpateError(message["error"]["text"], message["error"]["field"])
        return message["answer"]

    def grasp(self, object=None, again=False):
        return self.request("grasp", object=object, again=again)

    def close(self, bar=None):
        return self.request("close", bar=bar)

    def vent(self):
        return self.request("vent")

    def pressure(self, bar):
        return self.request("pressure", bar=bar)

    def tare(self):
        return self.request("tare")

    def record(self, object=None, seconds=None, end=False):
        return self.request("record", object=object, seconds=seconds, end=end)

    def label(self, object, trial=None, unsure=False):
        return self.request("label", object=object, trial=trial, unsure=unsure)

    def recognise(self):
        return self.request("recognise")

    def advise(self):
        return self.request("advise")

    def place(self, object=None, move=None):
        return self.request("place", object=object, move=move)

    def subscribe(self, to):
        """Asks for `rows`, `verdict` or `trial`; `events` yields them."""
        return self.request("subscribe", to=to)

    def events(self):
        """The events, until the connection ends."""
        return iter(self._events.get, None)

    def disconnect(self):
        """Ends the connection; air that this client moved is vented."""
        try:
            self._close()
        except OSError:
            pass  # the server was first

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.disconnect()


def unattended(palpate, grasps, objects):
    """Grasps objects of the emulated hand in turn, up to four times each, turned as advised; labels and records."""
    answered, right, decided, done = [], 0, 0, 0
    while done < grasps:
        name = objects[decided % len(objects)]
        palpate.place(object=name)
        for k in range(min(4, grasps - done)):
            result = palpate.grasp(again=k > 0)
            palpate.label(name, trial=result["trial"])
            done += 1
            for _ in range(20):
                asked = time.monotonic()
                palpate.recognise()
                answered.append(time.monotonic() - asked)
            verdict = result["verdict"]
            print(f"trial {result['trial']}: {name}, felt as {verdict['class']} ({verdict['probability']:.2f})")
            if verdict["decided"]:
                break
            advice = palpate.advise().get("advice")
            try:
                palpate.place(move=advice and advice["move"])
            except PalpateError as error:  # no room there: put down anew
                print(error)
                palpate.place()
        decided += 1
        right += verdict["class"] == name
    p95 = sorted(answered)[int(0.95 * len(answered))]
    print(f"{done} grasps of {decided} objects, {right} recognised; an answer within {1e3 * p95:.1f} ms at p95")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Grasps emulated objects unattended: labels and records each grasp.")
    parser.add_argument("--port", type=int, default=4747)
    parser.add_argument("--token-file", default="token.txt")
    parser.add_argument("--grasps", type=int, default=50)
    parser.add_argument("--objects", default="lemon,cube,ball,box,labello")
    chosen = parser.parse_args()
    try:
        with Palpate(chosen.port, token_file=chosen.token_file) as served:
            unattended(served, chosen.grasps, chosen.objects.split(","))
    except PalpateError as error:
        raise SystemExit(f"error: {error}") from None
