# SPDX-License-Identifier: BSD-3-Clause
"""What the measurements say, as Markdown tables and as a plot."""

import math

from curves import Curve, bd_rate, ratio_at

DISTANCES = {"extracted": "rms_extracted", "volume": "rms_volume"}
EQUAL = {"extracted": "at the distance to the extracted mesh", "volume": "at the distance to the volume's isosurface"}
COSTS = ("encode_vertices_per_second", "decode_vertices_per_second", "encode_peak_bytes", "decode_peak_bytes")
OURS = {"extracted": ("isoreel", "main to the mesh"), "volume": ("isoreel", "main")}  # what comes close to each
NOMINAL = 1 / 16  # the step that tables of one line a coder stand at


def curves_of(one_set, distance):
    """(coder, variant) -> its points and its curve, in the order measured."""
    points = {}
    for point in one_set["points"]:
        points.setdefault((point["coder"], point["variant"]), []).append(point)
    return {key: (own, Curve([(p[DISTANCES[distance]], p["bytes"]) for p in own])) for key, own in points.items()}


def nominal_point(one_set, distance):
    """Isoreel's own for this distance, at the step that is nearest to NOMINAL."""
    return min((p for p in one_set["points"] if (p["coder"], p["variant"]) == OURS[distance]),
               key=lambda p: abs(math.log(p["parameter"] / NOMINAL)))


def compare(one_set):
    """Adds to a set what follows from its points: each coder against Isoreel at equal distance."""
    one_set["comparison"] = []
    by_distance = {distance: curves_of(one_set, distance) for distance in DISTANCES}
    for key in by_distance["extracted"]:
        row = {"coder": key[0], "variant": key[1]}
        for distance, curves in by_distance.items():
            our_points, ours = curves[OURS[distance]]
            points, theirs = curves[key]
            name = DISTANCES[distance]
            nominal = nominal_point(one_set, distance)
            nearest = min(points, key=lambda p: abs(math.log(p[name] / nominal[name])))
            row[distance] = {
                "bytes": theirs.bytes_at(nominal[name]),
                "ratios": {step_name(p["parameter"]): ratio_at(ours, theirs, p[name]) for p in our_points},
                "bd_rate": bd_rate(ours, theirs),
                **{cost: nearest[cost] for cost in COSTS}}
        one_set["comparison"].append(row)


def step_name(step):
    return f"1/{round(1 / step)}"


def cell(value, form, factor=1.0):
    return "–" if value is None else format(value * factor, form)


def costs(point):
    speeds = [f"{point[cost] / 1e6:.2f}" for cost in COSTS[:2]]
    return " | ".join(speeds + [f"{point[cost] / 2**20:.1f} MiB" for cost in COSTS[2:]])


def isoreel_table(one_set):
    vertices = one_set["vertices"]
    yield ("| variant | step | bytes | bits/vertex | signs | motion | vertices | other | RMS to extracted | RMS to volume | "
           "encode Mv/s | decode Mv/s | encode peak | decode peak |")
    yield "| --- | --- " + "| ---: " * 12 + "|"
    for p in one_set["points"]:
        if p["coder"] == "isoreel":
            parts = p["parts"]
            yield (f"| {p['variant']} | {step_name(p['parameter'])} | {p['bytes']} | {8 * p['bytes'] / vertices:.2f} | "
                   f"{parts['signs']} | {parts['motion']} | {parts['vertices']} | {parts['other']} | "
                   f"{p['rms_extracted']:.4f} | {p['rms_volume']:.4f} | " + costs(p) + " |")


def comparison_table(one_set, distance):
    steps = list(one_set["comparison"][0][distance]["ratios"])
    yield "| coder | " + " | ".join(steps) + " | BD-rate |"
    yield "| --- " + "| ---: " * (len(steps) + 1) + "|"
    for row in one_set["comparison"]:
        if (row["coder"], row["variant"]) != OURS[distance]:
            cells = [cell(row[distance]["ratios"][step], ".2f") for step in steps]
            cells.append(cell(row[distance]["bd_rate"], "+.0f", 100) + " %")
            yield f"| {row['coder']}, {row['variant']} | " + " | ".join(cells).replace("– %", "–") + " |"


def others_table(one_set, distance):
    yield ("| coder | bytes | bits/vertex | encode Mv/s | decode Mv/s | encode peak | decode peak |")
    yield "| --- " + "| ---: " * 6 + "|"
    for row in one_set["comparison"]:
        size = row[distance]["bytes"]
        yield (f"| {row['coder']}, {row['variant']} | {cell(size, '.0f')} | {cell(size, '.2f', 8 / one_set['vertices'])} | "
               + costs(row[distance]) + " |")


def summary_table(sets, distance):
    """A line a coder, over all sets: what stands in the README."""
    yield "| coder | " + " | ".join(f"{s['name']}: bits/vertex | decode Mv/s" for s in sets) + " |"
    yield "| --- " + "| ---: | ---: " * len(sets) + "|"
    for coder, variant in dict.fromkeys((row["coder"], row["variant"]) for s in sets for row in s["comparison"]):
        cells = []
        for one_set in sets:
            row = next(r for r in one_set["comparison"] if (r["coder"], r["variant"]) == (coder, variant))[distance]
            cells += [cell(row["bytes"], ".2f", 8 / one_set["vertices"]), f"{row['decode_vertices_per_second'] / 1e6:.1f}"]
        yield f"| {coder}, {variant} | " + " | ".join(cells) + " |"


def markdown(results):
    """The whole report, line by line."""
    yield f"# Measurements of {results['date']}"
    yield ""
    yield f"    {results['command']}"
    yield ""
    yield f"{results['machine']}. `bench/README.md` says what is measured and how."
    yield ""
    for distance, (_, variant) in OURS.items():
        yield f"{EQUAL[distance].capitalize()} that Isoreel ({variant}) has at step 1/16:"
        yield ""
        yield from summary_table(results["sets"], distance)
        yield ""
    for one_set in results["sets"]:
        yield f"## {one_set['name']}"
        yield ""
        yield (f"{one_set['frames']} frames of {' × '.join(map(str, one_set['nodes']))}, {one_set['vertices']} vertices, "
               f"{one_set['triangles']} triangles. Distances and timings on {one_set['sampled_frames']} frames, timings "
               f"medians of {one_set['runs']} runs.")
        yield ""
        yield (f"- Extraction alone, which mesh coders need before they start: "
               f"{one_set['extracted_vertices_per_second'] / 1e6:.2f} million vertices a second on 1 thread")
        for each in one_set["throughput"]:
            yield (f"- Isoreel (main) at step 1/16, GOPs of 5 frames, on {each['threads']} thread{'s' if each['threads'] > 1 else ''}, by the wall's "
                   f"clock: encode {each['encode_vertices_per_second'] / 1e6:.2f}, decode "
                   f"{each['decode_vertices_per_second'] / 1e6:.2f} million vertices a second")
        yield ""
        yield from isoreel_table(one_set)
        yield ""
        for distance, (_, variant) in OURS.items():
            yield f"{EQUAL[distance].capitalize()} that Isoreel ({variant}) has at step 1/16:"
            yield ""
            yield from others_table(one_set, distance)
            yield ""
            yield f"Isoreel's bytes ({variant}) over theirs, {EQUAL[distance]} that it has at each step:"
            yield ""
            yield from comparison_table(one_set, distance)
            yield ""


def plot(results, path):
    """Bits a vertex over distance, log-log: a row of two panels a set."""
    import matplotlib

    matplotlib.use("svg")
    matplotlib.rcParams["svg.fonttype"] = "none"
    matplotlib.rcParams["svg.hashsalt"] = "isoreel"
    from matplotlib import pyplot, ticker

    sets = results["sets"]
    height = 4.2 * len(sets) + 0.6
    figure, axes = pyplot.subplots(len(sets), 2, figsize=(11, height), squeeze=False, layout="constrained")
    figure.get_layout_engine().set(rect=(0, 0.6 / height, 1, 1 - 0.6 / height))  # the legend goes below
    for one_set, row in zip(sets, axes):
        for distance, panel in zip(DISTANCES, row):
            for (coder, variant), (points, _) in curves_of(one_set, distance).items():
                panel.plot([p[DISTANCES[distance]] for p in points],
                           [8 * p["bytes"] / one_set["vertices"] for p in points], marker="o", markersize=3,
                           linewidth=2.5 if coder == "isoreel" else 1, label=f"{coder}, {variant}")
            panel.set(xscale="log", yscale="log", title=f"{one_set['name']}: RMS distance to the {distance}"
                      + (" mesh" if distance == "extracted" else "'s isosurface"), xlabel="cells",
                      ylabel="bits per vertex")
            for axis in (panel.xaxis, panel.yaxis):
                axis.set_major_locator(ticker.LogLocator(subs=(1, 2, 5)))
                axis.set_major_formatter(ticker.FormatStrFormatter("%g"))
                axis.set_minor_locator(ticker.NullLocator())
            panel.grid(True, alpha=0.25)
    figure.legend(*axes[0][0].get_legend_handles_labels(), loc="lower center", ncol=4)
    figure.savefig(path, metadata={"Date": None})
