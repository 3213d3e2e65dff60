"""The parts of the benchmark page that are words and tables."""
import math

from page import escape, paragraph
from tables import as_number, bullets, number, percent, table, tiles

# What Li et al. 2019 state: by estimator, the final-point error at gamma = 3 (fig. 12).
PAPER_ERROR = {"vgd": "about 0.2 m", "vgd_kinematic": "about 0.5 m", "ekf": "about 0.5 m"}
PAPER_ITERATIONS = "mean 19, at most 25"
PAPER_CONVERGENCE = "about 4"


def headline(result):
    about = result.summary.get("about")
    flights = result.all_arcs.groupby(["log", "sweep"], dropna=False).seed.nunique().sum()
    return [paragraph(about) if about else "",
            tiles([(str(flights), "flights"), (str(len(result.arcs)), "arcs judged"),
                   (str(len(result.labels)), "estimators and settings")])]


def failures(result):
    found = result.summary.get("failures") or []
    if not found:
        return ""
    lines = [f"{f.get('log')}, seed {f.get('seed')}: {f.get('reason')}" for f in found[:10]]
    if len(found) > 10:
        lines.append(f"and {len(found) - 10} more")
    return f'<div class="warnings"><b>Flights without a result</b>{bullets(lines)}</div>'


def interval(pair):
    return f" ({number(pair[0])} to {number(pair[1])})" if pair else ""


def paper_table(result):
    """The paper's figures beside ours."""
    rows = []
    for label in result.labels:
        group = _headline_group(result, label)
        if group is None:
            continue
        error, iterations = group["final_point_error"], group["iterations"]
        estimator = group["estimator"]
        ours = (f"mean {number(error.get('mean'))} m{interval(error.get('mean_interval95'))}, "
                f"median {number(error.get('median'))} m{interval(error.get('median_interval95'))}")
        rows.append([f"Final-point error, {escape(label)}, gamma {group['gamma']}",
                     escape(PAPER_ERROR.get(estimator, "–")), escape(ours)])
        if estimator == "vgd":
            rows.append([f"Iterations, {escape(label)}", PAPER_ITERATIONS,
                         escape(f"mean {number(iterations['mean'])}, at most {iterations['max']}")])
    rows += _convergence_rows(result)
    note = ("Paper: one real flight of 15 arcs with fixes drawn from Optitrack (eq. 33), fitted by "
            "FMINCON. Brackets: 95 % intervals by bootstrap over flights.")
    return [table([("", False), ("Paper", False), ("Here", False)], rows), paragraph(note, "note")]


def _headline_group(result, label):
    """The summary's group of a label on the first log, at the headline's gamma."""
    rows = result.headline(label)
    for group in result.summary.get("groups") or []:
        if rows.empty or group["label"] != label or group["log"] != rows.log.iloc[0]:
            continue
        if group["gamma"] == rows.gamma.iloc[0] and "sweep" not in group:
            return group
    return None


def _convergence_rows(result):
    """EKF's time over VGD's, for each quantity that both have."""
    entries = result.summary.get("convergence") or []
    gammas = {(e["label"], e["gamma"]) for e in entries}
    several = len(gammas) > len({label for label, _ in gammas})
    rows = []
    for slow in entries:
        for quick in entries:
            same = all(slow[k] == quick[k] for k in ("quantity", "log"))
            estimators = [result.estimator_of(e["label"]) for e in (slow, quick)]
            if not same or estimators != ["ekf", "vgd"]:
                continue
            times = [as_number(e.get("median_time_s")) for e in (slow, quick)]
            rows.append([f"Convergence of {escape(slow['quantity'])}: time of "
                         f"{escape(slow['label'])} over {escape(quick['label'])}"
                         + (f", gamma {quick['gamma']}" if several else ""),
                         PAPER_CONVERGENCE, escape(_ratio(*times))])
    return rows


def _ratio(slow, quick):
    if math.isinf(slow) and math.isinf(quick):
        return "neither converges on half of the flights"
    if math.isinf(slow):
        return f"over half of the first never converge; second {number(quick, 2)} s"
    if math.isinf(quick):
        return f"over half of the second never converge; first {number(slow, 2)} s"
    return f"{number(slow / quick, 2)} (medians {number(slow, 2)} s and {number(quick, 2)} s)"


def _of_what(result):
    """Leading columns of a table over groups of arcs or flights, and the cells of one group."""
    swept, sweep = result.has_sweep, result.summary.get("sweep") or {}
    several = len(result.logs) > 1
    columns = ([("Log", False)] if several else []) + [("Label", False), ("gamma", True)] + (
        [(f"{sweep.get('name', 'sweep')} [{sweep.get('unit', '1')}]", True)] if swept else [])

    def cells(group):
        return (([escape(group["log"])] if several else []) +
                [escape(group["label"]).replace(" ", "&nbsp;"), str(group["gamma"])] +
                ([number(group.get("sweep"))] if swept else []))
    return columns, cells


def convergence_table(result):
    columns, cells = _of_what(result)
    rows = []
    for entry in result.summary.get("convergence") or []:
        time = as_number(entry.get("median_time_s"))
        rows.append(cells(entry) +
                    [escape(entry["quantity"]), number(entry["tolerance"]),
                     percent(entry["converged"] / entry["flights"]),
                     "not reached" if math.isinf(time) else
                     escape(number(time) + interval(entry.get("median_time_interval95")))])
    return table(columns + [("Quantity", False), ("Tolerance [SI]", True),
                            ("Flights that converge", True), ("Median time [s]", True)], rows)


def starts_table(result):
    rows = [[escape(s["label"]), str(s["gamma"]), str(s["windows"]), str(s["starts"]),
             percent(s["same_optimum"]), number(s["iterations"]["mean"]),
             str(s["iterations"]["max"])] for s in result.summary["starts"]]
    return paragraph("Each window solved again from starts drawn from the ranges of Table 2; 'same "
                     "optimum' is within a tenth of a sigma of the best in every parameter.",
                     "note") + table(
        [("Label", False), ("gamma", True), ("Windows", True), ("Starts", True),
         ("Same optimum", True), ("Iterations, mean", True), ("Iterations, most", True)], rows)


def group_table(result):
    """All groups of summary.yaml."""
    groups = result.summary.get("groups") or []
    columns, cells = _of_what(result)
    rows = []
    for g in groups:
        error = g["final_point_error"]
        rows.append(cells(g) +
                    [str(g["flights"]), str(g["arcs"]),
                     escape(number(error.get("mean")) + interval(error.get("mean_interval95"))),
                     escape(number(error.get("median")) + interval(error.get("median_interval95"))),
                     number(error.get("p95")), percent(g.get("inside_95_ellipse")),
                     number(error.get("rms")), number(g.get("bound_rms_m")), number(g["iterations"]["mean"]),
                     str(g["iterations"]["max"])])
    columns += [
        ("Flights", True), ("Arcs", True), ("Mean [m]", True), ("Median [m]", True),
        ("95 % below", True), ("In 95 %", True), ("RMS [m]", True), ("Bound [m]", True),
        ("Iterations", True), ("most", True)]
    return [table(columns, rows)]


def seeds_in_words(result):
    """The provenance's seeds as text."""
    entries = result.summary.get("provenance") or {}
    seeds = entries.get("seeds")
    if isinstance(seeds, dict):
        first = seeds.get("first", 0)
        entries["seeds"] = f"{first} to {first + seeds.get('count', 1) - 1}"
