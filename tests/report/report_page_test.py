#!/usr/bin/env python3
"""The report from its command line to its page in a browser.

    report_page_test.py HALFSHADE DATA_DIR

Runs small reports, interrupts one, and opens the page in headless Chromium through chromedriver, with nothing but the standard
library. Needs chromium and chromium-driver (scripts/setup.sh).
"""
import csv
import json
import os
import pathlib
import shutil
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import time
import unittest
import urllib.error
import urllib.request
import zlib

HALFSHADE, DATA = sys.argv[1], pathlib.Path(sys.argv[2])
del sys.argv[1:3]
SCENES = [str(DATA / "scenes" / name) for name in ("boxes.json", "overlap.json")]
SMALL = ["--resolution", "96x80", "--light-res", "64,128", "--truth-samples", "256"]


def report(folder, *arguments, check=True, **keywords):
    command = [HALFSHADE, "report", *arguments, "-o", str(folder), "--cache", str(folder.parent / "cache")]
    return subprocess.run(command, capture_output=True, text=True, check=check, timeout=300, **keywords)


def load(folder):
    return json.loads((folder / "report.json").read_text())


def results_of(data):
    return [r for scene in data["scenes"] for light in scene["lights"] for r in light["results"]]


def png_gray(path):
    """The values of an 8-bit grey PNG."""
    data, at, packed = path.read_bytes(), 8, b""
    while at < len(data):
        size, kind = struct.unpack(">I4s", data[at:at + 8])
        if kind == b"IHDR":
            width, height, depth, colour = struct.unpack(">IIBB", data[at + 8:at + 18])
            assert (depth, colour) == (8, 0), path
        if kind == b"IDAT":
            packed += data[at + 8:at + 8 + size]
        at += size + 12
    raw, out, above = zlib.decompress(packed), [], [0] * width
    for y in range(height):
        kind, line = raw[y * (width + 1)], list(raw[y * (width + 1) + 1:(y + 1) * (width + 1)])
        for x in range(width):
            a, b, c = (line[x - 1] if x else 0), above[x], (above[x - 1] if x else 0)
            p = a + b - c
            near = min((abs(p - a), 0, a), (abs(p - b), 1, b), (abs(p - c), 2, c))[2]
            line[x] = (line[x] + (0, a, b, (a + b) // 2, near)[kind]) & 255
        out += line
        above = line
    return out


class Browser:
    """A headless Chromium behind chromedriver's HTTP interface."""

    def __init__(self, folder, *arguments):
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            port = free.getsockname()[1]
        self.driver = subprocess.Popen(["chromedriver", f"--port={port}", "--silent"], stdout=subprocess.DEVNULL)
        self.base = f"http://127.0.0.1:{port}"
        end = time.monotonic() + 30
        while not self.is_ready():
            if self.driver.poll() is not None or time.monotonic() > end:
                self.driver.kill()
                raise RuntimeError("chromedriver did not start; is chromium-driver installed?")
            time.sleep(0.05)
        self.base += "/session"
        flags = ["--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--disable-quic", "--no-first-run", "--disable-background-networking",
                 "--disable-component-update", "--disable-sync", f"--user-data-dir={folder}", "--window-size=1280,900", *arguments]
        logs = {"browser": "ALL", "performance": "ALL"}
        capabilities = {"browserName": "chrome", "goog:chromeOptions": {"args": flags}, "goog:loggingPrefs": logs}
        try:
            self.base += "/" + self.post("", {"capabilities": {"alwaysMatch": capabilities}})["sessionId"]
        except BaseException:  # a driver left behind would hold the test's output open for ever
            self.driver.kill()
            self.driver.wait(30)
            raise
        # Without a window manager a window may never have the focus, and its elements no focus events.
        self.post("/goog/cdp/execute", {"cmd": "Emulation.setFocusEmulationEnabled", "params": {"enabled": True}})

    def is_ready(self):
        try:
            with urllib.request.urlopen(self.base + "/status", timeout=5) as answer:
                return json.load(answer)["value"]["ready"]
        except OSError:
            return False

    def post(self, path, body):
        request = urllib.request.Request(self.base + path, json.dumps(body).encode(), {"Content-Type": "application/json"})
        try:
            with urllib.request.urlopen(request, timeout=60) as answer:
                return json.load(answer)["value"]
        except urllib.error.HTTPError as error:
            raise RuntimeError(f"chromedriver{path}: {error}: {error.read().decode(errors='replace')}") from error

    def open(self, path):
        self.post("/url", {"url": path.as_uri()})

    def run(self, script, *arguments):
        return self.post("/execute/sync", {"script": script, "args": list(arguments)})

    def wait_for(self, script, seconds=20):
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            value = self.run(script)
            if value:
                return value
            time.sleep(0.1)
        raise AssertionError("never true: " + script)

    def log(self, kind):
        return self.post("/se/log", {"type": kind})

    def keys(self, text):
        actions = [{"type": kind, "value": c} for c in text for kind in ("keyDown", "keyUp")]
        self.post("/actions", {"actions": [{"type": "key", "id": "keyboard", "actions": actions}]})

    def close(self):
        try:
            urllib.request.urlopen(urllib.request.Request(self.base, method="DELETE"), timeout=30).close()
        finally:
            self.driver.terminate()
            self.driver.wait(30)


class ReportTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = pathlib.Path(tempfile.mkdtemp(prefix="halfshade-report-"))
        cls.folder = cls.temporary / "report"
        cls.output = report(cls.folder, *SCENES, "--repeat", "2", *SMALL)
        cls.data = load(cls.folder)

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.temporary, ignore_errors=True)

    # ------------------------------------------------------------------------------------------------------------ files

    def test_every_method_and_rival_is_measured(self):
        methods = [line.split()[0] for line in subprocess.run([HALFSHADE, "methods"], capture_output=True, text=True,
                                                              check=True).stdout.splitlines()]
        measured = {r["method"] for r in results_of(self.data)}
        self.assertGreaterEqual(measured, {"hard", "pcf", "smoothies", "rays", "rays-adaptive"})
        for name in measured - {"rays", "rays-adaptive"}:
            self.assertIn(name, methods)
        for result in results_of(self.data):
            self.assertEqual(len(result["time_ms"]["runs"]), 2)
            self.assertEqual(result["figures"]["nonfinite"], 0)
            self.assertGreater(result["time_ms"]["median"], 0)
            if result["kind"] == "method":
                self.assertTrue(result["stages_ms"], result["label"])

    def test_rays_have_less_error_with_more_samples(self):
        for scene in self.data["scenes"]:
            rays = {int(r["settings"]["samples"]): r["figures"]["penumbra_rmse"] for r in scene["lights"][0]["results"]
                    if r["method"] == "rays"}
            self.assertEqual(sorted(rays, key=rays.get, reverse=True), sorted(rays))

    def test_csv_says_what_json_says(self):
        with open(self.folder / "report.csv", newline="") as file:
            rows = list(csv.DictReader(file))
        results = results_of(self.data)
        self.assertEqual(len(rows), len(results))
        for row, result in zip(rows, results):
            self.assertEqual(row["method"], result["method"])
            self.assertEqual(float(row["penumbra_rmse"]), result["figures"]["penumbra_rmse"])
            self.assertEqual(float(row["median_ms"]), result["time_ms"]["median"])
            self.assertEqual(row["pareto"], str(result["pareto"]).lower())
            negative = result["negative_pixels"]
            self.assertEqual(row["negative_pixels"], "" if negative is None else str(negative))
            self.assertEqual(negative is not None, result["method"] == "exact")

    def test_the_front_is_what_no_other_row_dominates(self):
        for scene in self.data["scenes"]:
            results = scene["lights"][0]["results"]
            points = [(r["time_ms"]["median"], r["figures"]["penumbra_rmse"]) for r in results]
            for (ms, error), result in zip(points, results):
                dominated = any(a <= ms and b <= error and (a, b) != (ms, error) for a, b in points)
                self.assertEqual(result["pareto"], not dominated, result["label"])
                runs = sorted(result["time_ms"]["runs"])
                self.assertEqual((result["time_ms"]["min"], result["time_ms"]["median"]), (runs[0], sum(runs) / 2))

    def test_every_row_has_the_time_in_which_rays_reach_its_error(self):
        for scene in self.data["scenes"]:
            results = scene["lights"][0]["results"]
            rays = [r for r in results if r["kind"] == "rival"]
            for result in results:
                reached = [r["time_ms"]["median"] for r in rays if r["figures"]["penumbra_rmse"] <= result["figures"]["penumbra_rmse"]]
                need = result["rays_time_at_error_ms"]
                self.assertEqual(need is None, not reached, result["label"])
                if reached:
                    self.assertLessEqual(need, min(reached) * 1.000001, result["label"])
                    self.assertGreaterEqual(need, min(r["time_ms"]["median"] for r in rays))

    def test_passes_are_those_of_the_light(self):
        for result in results_of(self.data):
            if result["kind"] == "rival":
                self.assertEqual(result["stages_ms"], {})
                continue
            self.assertIn("raster_shadow_map", result["stages_ms"])
            self.assertTrue(any(name.startswith(("receive_", "count_samples")) for name in result["stages_ms"]), result["label"])
            for name in ("raster_gbuffer", "shade", "camera/shade"):
                self.assertNotIn(name, result["stages_ms"])

    def test_says_what_was_run_where(self):
        command = self.data["command"].split()
        self.assertEqual(command[:2], ["halfshade", "report"])
        for part in (*SCENES, "96x80", "64", "128", "256", str(self.folder)):
            self.assertIn(part, command)
        self.assertEqual((self.data["truth_samples"], self.data["repeats"]), (256, 2))
        self.assertEqual([scene["name"] for scene in self.data["scenes"]], ["boxes", "overlap"])
        for scene in self.data["scenes"]:
            self.assertGreater(scene["lights"][0]["tree_build_ms"], 0)
        self.assertTrue(self.data["device"]["name"] and self.data["device"]["driver"] and self.data["date"] and self.data["host"])

    def test_figures_are_those_of_the_pictures(self):
        # The 8-bit pictures say the same as the figures, as far as they can.
        for scene in self.data["scenes"]:
            light = scene["lights"][0]
            truth = png_gray(self.folder / light["pictures"]["truth"]["picture"])
            penumbra = [i for i, t in enumerate(truth) if 0 < t < 255]
            self.assertGreater(len(penumbra), 50)
            for result in light["results"]:
                seen = png_gray(self.folder / result["picture"])
                rmse = (sum((seen[i] - truth[i]) ** 2 for i in penumbra) / len(penumbra)) ** 0.5 / 255
                self.assertAlmostEqual(rmse, result["figures"]["penumbra_rmse"], delta=0.003, msg=result["label"])

    def test_says_where_the_page_is(self):
        self.assertIn(str(self.folder / "index.html"), self.output.stdout)

    # ------------------------------------------------------------------------------------------------------ interruption

    def interrupt(self, folder, arguments, when):
        """Begins a report and interrupts it as soon as `when` holds of what it has written."""
        command = [HALFSHADE, "report", *arguments, "-o", str(folder), "--cache", str(self.temporary / "cache")]
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        end = time.monotonic() + 120
        while time.monotonic() < end and process.poll() is None:
            try:
                if when(load(folder)):
                    break
            except FileNotFoundError:
                pass
            time.sleep(0.005)
        process.send_signal(signal.SIGINT)
        self.assertEqual(process.wait(60), -signal.SIGINT)
        data = load(folder)
        self.assertFalse(data["complete"])
        return data

    def test_interrupted_twice_nothing_is_lost(self):
        # In the second scene; then again, while the first is being taken over.
        folder = self.temporary / "twice"
        arguments = [*SCENES, "--repeat", "40", *SMALL, "--methods", "hard,pcf,smoothies,rays"]
        before = self.interrupt(folder, arguments, lambda data: len(results_of({"scenes": data["scenes"][1:]})) > 3)
        kept = [{r["label"]: r["time_ms"]["cold"] for r in scene["lights"][0]["results"]} for scene in before["scenes"]]
        self.assertGreater(len(kept[1]), 3)
        self.interrupt(folder, [*arguments[:-1], "hard,pcf,smoothies,rays,fins"], lambda data: "fins" in data["command"])
        report(folder, *arguments)
        after = load(folder)
        self.assertTrue(after["complete"])
        self.assertNotIn("earlier", after)
        for scene, colds in zip(after["scenes"], kept):
            now = {r["label"]: r["time_ms"]["cold"] for r in scene["lights"][0]["results"]}
            self.assertEqual({label: now[label] for label in colds}, colds)

    def test_an_interrupted_run_goes_on(self):
        folder = self.temporary / "interrupted"
        arguments = [*SCENES, "--repeat", "9", *SMALL]
        before = self.interrupt(folder, arguments, lambda data: len(results_of(data)) >= 3)
        kept = {r["label"]: r for r in before["scenes"][0]["lights"][0]["results"]}
        self.assertEqual([p.name for p in folder.iterdir() if "tmp" in p.name], [])

        report(folder, *arguments)
        after = load(folder)
        self.assertTrue(after["complete"])
        self.assertTrue(all(len(r["time_ms"]["runs"]) == 9 for r in results_of(after)))
        now = {r["label"]: r for r in after["scenes"][0]["lights"][0]["results"]}
        for label, result in kept.items():
            self.assertEqual(now[label]["time_ms"]["cold"], result["time_ms"]["cold"], label)
            runs = result["time_ms"]["runs"]
            self.assertEqual(now[label]["time_ms"]["runs"][:len(runs)], runs, label)

        # A finished report is not gone on with: calling again measures again.
        report(folder, *arguments)
        again = {r["label"]: r for r in load(folder)["scenes"][0]["lights"][0]["results"]}
        self.assertTrue(any(again[label]["time_ms"]["cold"] != now[label]["time_ms"]["cold"] for label in now))

    # ------------------------------------------------------------------------------------------------------------- errors

    def test_wrong_usage_is_told(self):
        for arguments, part in ((["--methods", "nonsense"], "nonsense"), (["--truth-samples", "0"], "--truth-samples"),
                                (["--repeat", "x"], "--repeat"), (["--light-res", "0"], "--light-res")):
            result = report(self.temporary / "none", SCENES[0], *arguments, check=False)
            self.assertEqual(result.returncode, 2, result.stderr)
            self.assertIn(part, result.stderr)
            self.assertEqual(result.stderr.count("\n"), 1)
        self.assertFalse((self.temporary / "none").exists())

    # --------------------------------------------------------------------------------------------------------------- page

    def test_page_in_a_browser(self):
        browser = Browser(self.temporary / "profile")
        try:
            self.check_page(browser)
        finally:
            browser.close()

    def check_page(self, browser):
        browser.open(self.folder / "index.html")
        first = self.data["scenes"][0]["lights"][0]["results"]

        # Charts drawn: a point a result, inside the plot; the front; dominated ones marked.
        browser.wait_for("return document.querySelectorAll('.plot .point').length > 0")
        points = browser.run("""
            const box = document.querySelector('.plot').getBoundingClientRect();
            return [...document.querySelectorAll('.plot .point')].map(p => {
              const b = p.getBoundingClientRect();
              return {label: p.dataset.label, dominated: p.classList.contains('dominated'),
                inside: b.left >= box.left && b.right <= box.right && b.top >= box.top && b.bottom <= box.bottom && b.width > 3};
            });""")
        self.assertEqual({p["label"]: p["dominated"] for p in points}, {r["label"]: not r["pareto"] for r in first})
        self.assertTrue(all(p["inside"] for p in points))
        self.assertGreater(browser.run("return document.querySelector('.plot .front').getTotalLength()"), 10)
        # Slower is further right, more error higher up.
        places = browser.run("""return Object.fromEntries([...document.querySelectorAll('.plot .point')].map(p => {
            const b = p.getBoundingClientRect(); return [p.dataset.label, [b.left + b.width / 2, b.top + b.height / 2]]; }))""")
        slowest, fastest = (f(first, key=lambda r: r["time_ms"]["median"])["label"] for f in (max, min))
        self.assertGreater(places[slowest][0], places[fastest][0])
        worst, best = (f(first, key=lambda r: r["figures"]["penumbra_rmse"])["label"] for f in (max, min))
        self.assertLess(places[worst][1], places[best][1])

        # Settings appear on keyboard focus.
        sine = next(r["label"] for r in first if r["settings"].get("falloff") == "sine")
        tip = browser.run("[...document.querySelectorAll('.plot .point')].find(p => p.dataset.label === arguments[0]).focus();"
                          "return document.getElementById('tip').textContent", sine)
        self.assertIn("falloff sine", tip)
        browser.keys("\ue007")
        self.assertEqual(sine, browser.run("return document.querySelector('tr.chosen').dataset.label"))

        # The table sorts, by number and both ways.
        order = "return [...document.querySelectorAll('table.figures > tbody > tr')].map(r => r.dataset.label)"
        column = "[...document.querySelectorAll('table.figures > thead th button')].find(b => b.textContent === 'penumbra rmse')"
        by_error = [r["figures"]["penumbra_rmse"] for r in sorted(first, key=lambda r: r["figures"]["penumbra_rmse"])]
        error_of = {r["label"]: r["figures"]["penumbra_rmse"] for r in first}
        browser.run(f"{column}.click()")
        self.assertEqual([error_of[label] for label in browser.run(order)], by_error)
        browser.run(f"{column}.focus()")
        browser.keys(" ")
        self.assertEqual([error_of[label] for label in browser.run(order)], by_error[::-1])
        self.assertEqual(browser.run(f"return {column}.parentNode.getAttribute('aria-sort')"), "descending")

        # The slider moves what is seen of the method, by key and by pointer.
        browser.wait_for("return document.querySelector('.stage').dataset.shows")
        inset = "return document.querySelector('.stage .over').style.clipPath"
        start = browser.run(inset)
        browser.run("document.querySelector('.slider').focus()")
        browser.keys("\ue014\ue014\ue014")
        self.assertNotEqual(browser.run(inset), start)
        browser.run("""const stage = document.querySelector('.stage'), b = stage.getBoundingClientRect();
            stage.dispatchEvent(new PointerEvent('pointerdown', {clientX: b.left + b.width * 0.25, clientY: b.top + 5, buttons: 1}))""")
        self.assertIn("75%", browser.run(inset))

        # Pictures at full resolution: visibility is the stored one, the error map is coloured where there is error.
        scene = self.data["scenes"][0]
        browser.run("[...document.querySelectorAll('.tools button')].find(b => b.textContent === 'error').click()")
        browser.wait_for("return document.querySelector('.stage').dataset.shows.startsWith('error')")
        picture = browser.run("""const c = document.querySelector('.stage .over'), d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;
            let coloured = 0; for (let i = 0; i < d.length; i += 4) coloured += Math.abs(d[i] - d[i + 2]) > 12;
            return {size: [c.width, c.height], coloured};""")
        self.assertEqual(picture["size"], scene["resolution"])
        self.assertGreater(picture["coloured"], 20)
        self.assertLess(picture["coloured"], 96 * 80 / 2)

        # The strips draw when seen.
        browser.run("document.querySelector('.strips').scrollIntoView()")
        browser.wait_for("return document.querySelector('.strip canvas').width === 240")

        # The other scene, and a narrow window: nothing wider than the page.
        browser.run("document.querySelectorAll('#cases button')[1].click()")
        self.assertIn(self.data["scenes"][1]["name"], browser.run("return document.querySelector('h2').textContent"))
        browser.post("/window/rect", {"width": 500, "height": 800})
        self.assertLessEqual(*browser.run("return [document.documentElement.scrollWidth, document.documentElement.clientWidth]"))

        # No error in the console, and no request but for the page itself.
        self.assertEqual([entry for entry in browser.log("browser") if entry["level"] in ("SEVERE", "WARNING")], [])
        page = (self.folder / "index.html").as_uri()
        requests = []
        for entry in browser.log("performance"):
            message = json.loads(entry["message"])["message"]
            # Of this page alone: the browser's own first page asks for much.
            if message["method"] == "Network.requestWillBeSent" and message["params"]["documentURL"].startswith(page):
                requests.append(message["params"]["request"]["url"])
        self.assertIn(page, requests)
        self.assertEqual([url for url in requests if url != page and not url.startswith("data:")], [])


if __name__ == "__main__":
    os.environ.setdefault("XDG_CACHE_HOME", tempfile.gettempdir())
    unittest.main(verbosity=2)
