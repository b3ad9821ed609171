#!/usr/bin/env python3
"""Writes the README's tables of methods and options from what the program declares.

    scripts/readme_tables.py [--check] [PROGRAM]

PROGRAM is build/release/halfshade by default. With --check writes nothing, and fails where the README is stale.
"""
import argparse
import json
import pathlib
import subprocess

ROOT = pathlib.Path(__file__).resolve().parent.parent
BEGIN, END = "<!-- methods: scripts/readme_tables.py -->\n", "<!-- methods end -->\n"


def cell(text):
    """Text in a cell of a table."""
    return text.replace("|", "\\|")


def code(text):
    return f"`{cell(text)}`" if text else ""


def table(heads, rows):
    lines = ["| " + " | ".join(heads) + " |", "|" + "---|" * len(heads)]
    return lines + ["| " + " | ".join(row) + " |" for row in rows] + [""]


def method_table(methods):
    def row(method):
        source = "" if method["source"] == "halfshade" else f" ({method['source']})"
        options = " ".join(f"--{option['name']}" for option in method["options"])
        default = "; the default" if method["is_default"] else ""
        return [code(method["name"]), cell(method["summary"] + source + default), code(options)]

    return table(["method", "what it is", "options it uses"], map(row, methods))


def property_table(methods):
    """The columns of Table 1 of Hasenfratz et al. 2003."""
    def row(method):
        lights = "discs and rectangles" if method["any_shape"] else "discs"
        return [code(method["name"]), cell(method["exact_when"]), cell(method["receivers"]), lights, cell(method["time"])]

    return table(["method", "penumbra exact when", "receivers", "lights", "time grows with"], map(row, methods))


def option_table(methods):
    """A row an option; two where methods declare different values under one name."""
    rows = {}
    for method in methods:
        for option in method["options"]:
            key = (option["name"], option["values"], option["summary"])
            rows.setdefault(key, []).append((method["name"], option["default"], option["switch"]))

    def row(key, uses):
        name, values, summary = key
        defaults = list(dict.fromkeys(default for _, default, _ in uses))
        if uses[0][2]:
            default = "off"
        elif len(defaults) == 1:
            default = code(defaults[0])
        else:
            default = ", ".join(f"{method} {code(default)}" for method, default, _ in uses)
        users = "all" if len(uses) == len(methods) else ", ".join(code(method) for method, _, _ in uses)
        return [code(f"--{name} {values}".rstrip()), cell(summary), default, users]

    return table(["option", "what it is", "default", "methods"], (row(*item) for item in rows.items()))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true")
    parser.add_argument("program", nargs="?", default=ROOT / "build/release/halfshade")
    arguments = parser.parse_args()

    printed = subprocess.run([arguments.program, "methods", "--json"], check=True, capture_output=True, text=True).stdout
    methods = json.loads(printed)
    readme = ROOT / "README.md"
    text = readme.read_text()
    before, _, rest = text.partition(BEGIN)
    _, _, after = rest.partition(END)
    if not rest or not after:
        raise SystemExit(f"readme_tables: {readme}: expected the lines '{BEGIN.strip()}' and '{END.strip()}'")
    tables = method_table(methods) + property_table(methods) + option_table(methods)
    made = before + BEGIN + "\n" + "\n".join(tables) + "\n" + END + after
    if not arguments.check:
        readme.write_text(made)
    elif made != text:
        raise SystemExit("readme_tables: README.md: its tables of methods differ from 'halfshade methods'; "
                         "run scripts/readme_tables.py")


if __name__ == "__main__":
    main()
