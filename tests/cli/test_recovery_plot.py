"""``recover --plot``: intervals that close, certificate and regret that fall, as SVG."""

import json
import xml.etree.ElementTree as ET

import numpy as np

SVG = "{http://www.w3.org/2000/svg}"


def points(element):
    return np.array([p.split(",") for p in element.get("points").split()], dtype=float)


def test_the_plot_shows_intervals_closing_about_the_ground_truth(call, tmp_path):
    plot, result = tmp_path / "a.svg", tmp_path / "a.json"
    argv = ("recover", "--domain", "lqr", "--no-record", "--plot", plot, "--json", result)
    code, out, _ = call(*argv)
    assert code == 0 and "no confidence interval" in out
    root, found = ET.parse(plot).getroot(), json.loads(result.read_text())
    words = [t.text for t in root.iter(f"{SVG}text")]
    assert {*found["objectives"], "certificate", "best regret", "probes"} <= {*words}
    regions = [points(p) for p in root.iter(f"{SVG}polygon")]
    assert len(regions) == len(found["objectives"])
    for region in regions:
        upper, lower = np.split(region, 2)
        gap = lower[::-1, 1] - upper[:, 1]
        assert (gap >= 0).all() and (np.diff(gap) <= 0.15).all()  # rounded to 0.1
        assert gap[-1] < 0.1 * gap[0]
    truths = [line for line in root.iter(f"{SVG}line") if line.get("stroke") == "#c81e46"]
    for region, truth in zip(regions, truths, strict=True):
        y = float(truth.get("y1"))
        assert region[:, 1].min() - 0.1 <= y <= region[:, 1].max() + 0.1


def test_the_plot_of_another_method_is_refused(complaint):
    said = complaint("recover", "--domain", "lqr", "--method", "mwal", "--plot", "a.svg")
    assert "--plot draws CPIRL's own runs" in said
    assert ".svg" in complaint("recover", "--domain", "lqr", "--plot", "a.png")
