"""A page in Chromium without a window, by its debugging pipe: waits until the page says that it is ready or has failed
(data-state of its root), does what is asked, and keeps its picture and document. Usage:

    browser.py URL SIZE OUT.png OUT.html [key:NAME | click:X,Y | drag:X,Y,X,Y | tell:EXPRESSION]… [-- CHROMIUM_OPTION …]

SIZE is a number, or WIDTHxHEIGHT; with an m behind it the page is on a phone with a touch screen. `tell` prints the value of an
expression, a line each.
"""
import base64
import json
import os
import re
import select
import signal
import subprocess
import sys
import time

ANSWER_SECONDS, READY_SECONDS = 120, 120
OPTIONS = ["--headless", "--no-sandbox", "--no-first-run", "--disable-extensions", "--disable-background-networking", "--hide-scrollbars",
           "--remote-debugging-pipe", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
DRAWN = "new Promise(r => requestAnimationFrame(() => requestAnimationFrame(() => setTimeout(r, 0)))).then(() => '')"
DOCUMENT = "document.querySelectorAll('script').forEach(s => s.remove()), document.documentElement.outerHTML"


class Browser:
    def __init__(self, options):
        commands, answers = os.pipe(), os.pipe()
        self.to, self.answers, self.buffer, self.calls, self.session = commands[1], answers[0], b"", 0, {}
        # Chromium reads commands from descriptor 3 and writes answers to 4.
        self.process = subprocess.Popen(["bash", "-c", f'exec "$@" 3<&{commands[0]} 4>&{answers[1]}', "bash", "chromium", *OPTIONS, *options],
                                        pass_fds=(commands[0], answers[1]), start_new_session=True)
        os.close(commands[0])
        os.close(answers[1])

    def receive(self):
        """Returns the next message. Messages end in NUL."""
        while b"\0" not in self.buffer:
            ready, _, _ = select.select([self.answers], [], [], ANSWER_SECONDS)
            more = os.read(self.answers, 1 << 20) if ready else b""
            if not more:
                raise RuntimeError("chromium does not answer")
            self.buffer += more
        message, self.buffer = self.buffer.split(b"\0", 1)
        return json.loads(message)

    def call(self, method, **parameters):
        self.calls += 1
        message = json.dumps({"id": self.calls, "method": method, "params": parameters, **self.session}).encode() + b"\0"
        while message:
            message = message[os.write(self.to, message):]
        while True:
            answer = self.receive()
            if answer.get("id") == self.calls:
                return answer["result"]

    def evaluate(self, expression):
        """Returns the string that an expression or its promise has as value, or an empty one."""
        result = self.call("Runtime.evaluate", expression=expression, awaitPromise=True, returnByValue=True)["result"].get("value")
        return result if isinstance(result, str) else ""

    def open(self, url, size):
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        self.session = {"sessionId": self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]}
        width, height, phone = re.fullmatch(r"(\d+)(?:x(\d+)(m?))?", size).groups()
        self.call("Emulation.setDeviceMetricsOverride", width=int(width), height=int(height or width), deviceScaleFactor=1, mobile=bool(phone))
        self.call("Emulation.setTouchEmulationEnabled", enabled=bool(phone))
        self.call("Page.navigate", url=url)
        end = time.monotonic() + READY_SECONDS
        while self.evaluate("document.documentElement.dataset.state || ''") not in ("ready", "failed"):
            if time.monotonic() > end:
                raise RuntimeError("the page is never ready")
            time.sleep(0.02)

    def mouse(self, kind, x, y, buttons):
        self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, buttons=buttons, button="none" if kind == "mouseMoved" else "left", clickCount=1)

    def act(self, action):
        kind, _, what = action.partition(":")
        if kind in ("click", "drag"):
            x, y, *end = map(float, what.split(","))
            self.mouse("mouseMoved", x, y, 0)
            self.mouse("mousePressed", x, y, 1)
            if kind == "drag":
                self.mouse("mouseMoved", (x + end[0]) / 2, (y + end[1]) / 2, 1)
                self.mouse("mouseMoved", *end, 1)
                x, y = end
            self.mouse("mouseReleased", x, y, 0)
        elif kind == "key":
            self.call("Input.dispatchKeyEvent", type="keyDown", key=what, text="\r" if what == "Enter" else what if len(what) == 1 else "")
            self.call("Input.dispatchKeyEvent", type="keyUp", key=what)
        elif kind == "tell":
            print(self.evaluate(what), flush=True)
        else:
            raise ValueError(action)


def main(url, size, picture, document, *words):
    end = words.index("--") if "--" in words else len(words)
    browser = Browser(words[end + 1:])
    try:
        browser.open(url, size)
        for action in words[:end]:
            browser.act(action)
            browser.evaluate(DRAWN)
        browser.evaluate(DRAWN)
        with open(picture, "wb") as out:
            out.write(base64.b64decode(browser.call("Page.captureScreenshot")["data"]))
        with open(document, "w", encoding="utf-8") as out:
            out.write(browser.evaluate(DOCUMENT))
        browser.session = {}
        browser.call("Browser.close")
        browser.process.wait()
    except BaseException:
        os.killpg(browser.process.pid, signal.SIGKILL)
        raise


main(*sys.argv[1:])
