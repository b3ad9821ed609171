#!/usr/bin/env python3
"""Writes the README's table and plot of speed against error from a report.

    scripts/readme_figures.py out/report/report.json [SCENE ...]

Of the scenes named, or of all.
"""
import html
import json
import math
import pathlib
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
BEGIN, END = "<!-- figures: scripts/readme_figures.py REPORT.json [SCENE ...] -->\n", "<!-- figures end -->\n"
PLOT = "data/images/speed_error.svg"
COLORS = ["#0b63c5", "#b84a00", "#0b7a53", "#9b2c86", "#7a5c00", "#00707f", "#b3203a", "#5646c2", "#4d7300", "#6b4a3a"]
WIDTH, HEIGHT, LEFT, TOP, RIGHT, BOTTOM = 420, 300, 48, 30, 12, 36


def settings_text(result):
    return ", ".join(f"{name.removesuffix('_px').replace('_', ' ')} {value}" for name, value in result["settings"].items())


def is_rival(result):
    return result["kind"] == "rival"


def lights_of(data):
    return [(scene, light) for scene in data["scenes"] for light in scene["lights"]]


def name_of(scene, light):
    return scene["name"] + (f", {light['name']}" if len(scene["lights"]) > 1 else "")


def ms_text(ms):
    return f"{ms:.0f}" if ms >= 100 else f"{ms:#.3g}"


def short_text(result):
    """The settings that cost time, for a table of methods with their defaults."""
    units = {"samples": "", "more_samples": " more", "layers": " layers", "pcss_taps": " taps"}
    return " and ".join(value + units[name] for name, value in result["settings"].items() if name in units)


def table(data):
    """Each method with its defaults, and every rival: a row each, a column a scene."""
    lights = lights_of(data)
    heads = [f"{name_of(scene, light)}, {scene['triangles']:,} triangles" for scene, light in lights]
    lines = ["| ms · penumbra rmse | " + " | ".join(heads) + " |", "|---|" + "---:|" * len(heads)]
    for first in (r for r in lights[0][1]["results"] if r["is_default"] or is_rival(r)):
        cells = []
        for _, light in lights:
            r = next((r for r in light["results"] if r["label"] == first["label"]), None)
            cells.append("" if r is None else f"{'★ ' if r['pareto'] else ''}{ms_text(r['time_ms']['median'])} · {r['figures']['penumbra_rmse']:.4f}")
        text = short_text(first)
        lines.append(f"| `{first['method']}`{' ' + text if text else ''} | " + " | ".join(cells) + " |")
    return lines + [""]


def words(data):
    """What is on the Pareto front, and how rays compare."""
    lines = []
    for scene, light in lights_of(data):
        ours = [r for r in light["results"] if not is_rival(r)]
        front = list(dict.fromkeys(r["method"] for r in ours if r["pareto"]))
        dominated = [name for name in dict.fromkeys(r["method"] for r in ours) if name not in front]
        text = f"{name_of(scene, light)}: methods on the Pareto front, in some setting: {', '.join(front) or 'none'}."
        if dominated:
            text += f" Dominated in every setting: {', '.join(dominated)}."
        rays = sorted((r for r in light["results"] if is_rival(r) and r["pareto"]), key=lambda r: r["time_ms"]["median"])
        slower = [r["method"] for r in ours if r["is_default"] and (r["rays_time_at_error_ms"] or math.inf) < r["time_ms"]["median"]]
        if slower:
            text += f" Rays reach the error of {', '.join(slower)} in less time."
        if rays:
            text += " Rays on the Pareto front: " + ", ".join(
                f"{r['method']} {short_text(r)} ({ms_text(r['time_ms']['median'])} ms, {r['figures']['penumbra_rmse']:.3g})" for r in rays) + "."
        else:
            text += " No rays are on the Pareto front."
        speedups = [(r["rays_time_at_error_ms"] / r["time_ms"]["median"], r) for r in ours if r["rays_time_at_error_ms"] is not None]
        if speedups:
            speedup, r = max(speedups, key=lambda pair: pair[0])
            text += f" Largest speed-up over rays at equal penumbra error: {speedup:.3g}×, by {r['method']} ({settings_text(r)})."
        lines.append(f"- {text}")
    return lines + [""]


def plot(data):
    panels = lights_of(data)
    shown = {id(light): [r for r in light["results"] if r["figures"]["penumbra_rmse"] > 0] for _, light in panels}
    panels = [(scene, light) for scene, light in panels if shown[id(light)]]
    if not panels:
        raise SystemExit("readme_figures: expected a report with penumbrae (found none to plot)")
    methods = list(dict.fromkeys(r["method"] for _, light in panels for r in light["results"] if not is_rival(r)))
    everything = [r for _, light in panels for r in shown[id(light)]]
    x_range = [f(r["time_ms"]["median"] for r in everything) * k for f, k in ((min, 0.8), (max, 1.25))]
    y_range = [f(r["figures"]["penumbra_rmse"] for r in everything) * k for f, k in ((min, 0.8), (max, 1.3))]

    def along(value, limits):
        return math.log(value / limits[0]) / math.log(limits[1] / limits[0])

    def ticks(limits):
        values = [m * 10.0 ** e for e in range(-6, 7) for m in (1, 2, 5)]
        return [v for v in values if limits[0] <= v <= limits[1]]

    columns = min(2, len(panels))
    rows = -(-len(panels) // columns)
    legend_height = 24 * -(-(len(methods) + 2) // (3 * columns)) + 8
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {columns * WIDTH} {rows * HEIGHT + legend_height}" '
           'font-family="system-ui, sans-serif" font-size="11" role="img">',
           "<title>Time against penumbra error of every method and of rays</title>",
           f'<rect width="{columns * WIDTH}" height="{rows * HEIGHT + legend_height}" fill="#ffffff"/>']

    def point(method, rival, x, y, dominated):
        fill = "#c3c7cc" if dominated else "#30343a" if rival else COLORS[methods.index(method) % len(COLORS)]
        if rival:
            shape = "-5,4 5,4 0,-5" if method != "rays" else "0,-6 4.5,0 0,6 -4.5,0"
            return f'<polygon points="{shape}" transform="translate({x:.1f},{y:.1f})" fill="{fill}">'
        return f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4.5" fill="{fill}">'

    for i, (scene, light) in enumerate(panels):
        x0, y0 = i % columns * WIDTH, i // columns * HEIGHT
        inner_width, inner_height = WIDTH - LEFT - RIGHT, HEIGHT - TOP - BOTTOM

        def place(r):
            return (x0 + LEFT + inner_width * along(r["time_ms"]["median"], x_range),
                    y0 + TOP + inner_height * (1 - along(r["figures"]["penumbra_rmse"], y_range)))

        name = name_of(scene, light)
        out.append(f'<text x="{x0 + LEFT}" y="{y0 + 18}" font-weight="600" font-size="13" fill="#1c1f23">{html.escape(name)}</text>')
        for value in ticks(x_range):
            x = x0 + LEFT + inner_width * along(value, x_range)
            out.append(f'<path d="M{x:.1f},{y0 + TOP}v{inner_height}" stroke="#e3e5e8"/>'
                       f'<text x="{x:.1f}" y="{y0 + HEIGHT - BOTTOM + 14}" text-anchor="middle" fill="#5d646d">{value:g}</text>')
        for value in ticks(y_range):
            y = y0 + TOP + inner_height * (1 - along(value, y_range))
            out.append(f'<path d="M{x0 + LEFT},{y:.1f}h{inner_width}" stroke="#e3e5e8"/>'
                       f'<text x="{x0 + LEFT - 5}" y="{y + 4:.1f}" text-anchor="end" fill="#5d646d">{value:g}</text>')
        out.append(f'<text x="{x0 + WIDTH - RIGHT}" y="{y0 + HEIGHT - 6}" text-anchor="end" fill="#5d646d">'
                   "time, ms; upwards: penumbra rmse; lower left is better</text>")
        results = shown[id(light)]
        front = sorted((r for r in results if r["pareto"]), key=lambda r: r["time_ms"]["median"])
        steps = "".join((f"M{x:.1f},{y:.1f}" if k == 0 else f"H{x:.1f}V{y:.1f}") for k, (x, y) in enumerate(map(place, front)))
        out.append(f'<path d="{steps}" fill="none" stroke="#30343a" stroke-dasharray="4 3"/>')
        for r in sorted(results, key=lambda r: r["pareto"]):
            shape = point(r["method"], is_rival(r), *place(r), not r["pareto"])
            tag = shape[1:shape.index(" ")]
            out.append(f"{shape}<title>{html.escape(r['label'])}</title></{tag}>")

    rivals = list(dict.fromkeys(r["method"] for _, light in panels for r in light["results"] if is_rival(r)))
    for k, name in enumerate(methods + rivals):
        x = 16 + k % (3 * columns) * (WIDTH // 3)
        y = rows * HEIGHT + 14 + k // (3 * columns) * 24
        shape = point(name, name in rivals, x, y, False)
        out.append(f'{shape}</{shape[1:shape.index(" ")]}><text x="{x + 11}" y="{y + 4}" fill="#1c1f23">{html.escape(name)}</text>')
    return "\n".join(out + ["</svg>", ""])


def main():
    if len(sys.argv) < 2:
        raise SystemExit(__doc__.strip())
    data = json.loads(pathlib.Path(sys.argv[1]).read_text())
    if not data.get("complete"):
        raise SystemExit(f"readme_figures: {sys.argv[1]}: expected a complete report (this one was interrupted); run report again")
    wanted = sys.argv[2:]
    known = [scene["name"] for scene in data["scenes"]]
    for name in wanted:
        if name not in known:
            raise SystemExit(f"readme_figures: {sys.argv[1]}: expected a scene '{name}' (found {', '.join(known)})")
    if wanted:
        data["scenes"] = [scene for scene in data["scenes"] if scene["name"] in wanted]
    readme = ROOT / "README.md"
    text = readme.read_text()
    before, _, rest = text.partition(BEGIN)
    _, _, after = rest.partition(END)
    if not rest or not after:
        raise SystemExit(f"readme_figures: {readme}: expected the lines '{BEGIN.strip()}' and '{END.strip()}'")
    device = data["device"]
    section = [f"![Time against error]({PLOT})", "",
               f"On {device['name']} ({device['platform']}, driver {device['driver']}), rays on {data['host']}, version {data['version']},"
               f" {data['date'][:10]}, {data['truth_samples']} rays a pixel as truth, medians of {data['repeats']}. Methods with their defaults;"
               " the plot has all settings. ★: on the Pareto front: nothing else that was measured is as fast and as accurate.", ""]
    section += table(data) + words(data)
    (ROOT / PLOT).parent.mkdir(exist_ok=True)
    (ROOT / PLOT).write_text(plot(data))
    readme.write_text(before + BEGIN + "\n" + "\n".join(section) + END + after)


if __name__ == "__main__":
    main()
