"""The page of trueline diagnose: verdict, causes, misfit, everything that was tried, residuals."""
import plotly.graph_objects as go

import against_sections
import misfit_sections
from charts import BAD, FIXES, MUTED, decimate, embed, style
from csv_table import read_table
from errors import ReportError
from page import Page, details, escape, paragraph, sentence, verdict
from tables import badge, bullets, number, table, tiles, with_sigma
from yaml_file import read_mapping

VERDICTS = {"clean": "Nothing of the catalogue shows in this flight; the table says what would have.",
            "explained": "The causes below explain what the model gets wrong, with what they gain.",
            "ambiguous": "Something is wrong, and more than one effect would explain it.",
            "unexplained": "A significant misfit remains, and no cause explains it on held-out flight."}
NAMED_BESIDE = ("The causes below are named. Beside them a significant misfit remains, which no cause explains on "
                "held-out flight.")

WITNESS = {"confirms": "another stream shows it directly", "refutes": "another stream refutes it",
           "silent": "no other stream can tell"}


def build(arguments):
    path = arguments.result / "diagnosis.yaml"
    result = read_mapping(path)
    if result.get("verdict") not in VERDICTS:
        raise ReportError(f"{path}: 'verdict' is missing or not known")
    page = Page("Diagnosis", str(result.get("provenance", {}).get("log", "")))
    if result.get("drive") == "commands":
        against_sections.add_to(page, result, arguments.result)
        return page
    trim = result.get("trim")
    if trim:
        result["causes"] = [cause for cause in result["causes"] if cause not in trim["causes"]]
    page.add("verdict", "Result", *_verdict(result))
    if misfit := misfit_sections.sections(result, arguments.result):
        page.add("misfit", "Misfit", *misfit)
    page.add("candidates", "What was tried", *_candidates(result))
    page.add("residuals", "Residuals", _noise_tiles(result), *_residuals(result, arguments.result))
    if trim:
        against_sections.add_to(page, trim, arguments.result, beside=True)
    return page


KINDS = {"clean": "good", "explained": "good", "ambiguous": "fair", "unexplained": "bad"}


def _verdict(result):
    causes = result.get("causes") or []
    unexplained = result["verdict"] == "unexplained"
    meaning = NAMED_BESIDE if unexplained and causes else VERDICTS[result["verdict"]]
    blocks = [verdict(KINDS[result["verdict"]], f"{result['verdict'].capitalize()}. {meaning}",
                      [_in_short(cause) for cause in causes])]
    if result.get("next"):
        blocks += ["<h3>What to do</h3>", bullets(result["next"])]
    if fixes := result.get("fixes"):
        blocks.append(paragraph(fixes[0].upper() + fixes[1:] + "."))
    if result.get("log_faults"):
        blocks += ["<h3>The log has faults, which may cause all that follows</h3>",
                   bullets(result["log_faults"])]
    for cause in causes:
        blocks += _cause(cause)
    together = _gains(result)
    if len(causes) > 1 and together:
        blocks += ["<h3>All causes together</h3>", *together]
    if result.get("model_lacks"):
        blocks.append(paragraph(f"model.yaml lacks {result['model_lacks']}."))
    blocks += _terms(result)
    if result.get("goes_with"):
        blocks += ["<h3>The residual is correlated with</h3>", bullets(result["goes_with"])]
    if result.get("not_shown"):
        blocks.append(paragraph("This flight can't show " + ", ".join(result["not_shown"])
                                + ": only sizes that no vehicle has would have been found.", "note"))
    return blocks + _evidence(result) + _set_aside(result.get("set_aside") or [])


def _in_short(cause):
    sizes = ", ".join(f"{name} {with_sigma(p['value'], p['sigma'])} {p['unit']}"
                      for name, p in cause["parameters"].items() if "sigma" in p)
    return f"{cause['id'].replace('_', ' ')}: {sizes}"


def _set_aside(causes):
    if not causes:
        return []
    blocks = [paragraph("These stand out of the noise, but are not named, for the reason stated with each.")]
    for cause in causes:
        blocks += _cause(cause)
    return [details(f"Set aside: {', '.join(cause['id'] for cause in causes)}", "".join(blocks))]


SOURCES = {"flight": "this flight", "held_out": "held-out flight", "witness": "another stream", "other_flights": "other flights",
           "prior": "number of hypotheses"}


def _evidence(result):
    """What speaks for each cause and against it, source by source, as bars."""
    causes = [cause for cause in [*(result.get("causes") or []), *(result.get("set_aside") or [])]
              if "evidence" in cause][:12]
    if not causes:
        return []
    figure = go.Figure()
    names = [cause["id"] + (" (set aside)" if cause.get("because") else "") for cause in causes]
    rows = [f"{i + 1}. {name}" for i, name in enumerate(names)][::-1]
    for source, what in SOURCES.items():
        parts = [cause["evidence"].get(source, 0) for cause in causes][::-1]
        if any(parts):
            figure.add_bar(y=rows, x=parts, name=what, orientation="h")
    figure.add_vline(x=result["evidence_needed"], line_dash="dash", line_color=MUTED)
    figure.update_layout(barmode="relative")
    style(figure, 110 + 30 * len(causes))
    figure.update_xaxes(title_text="evidence (log of the likelihood ratio)")
    figure.update_yaxes(automargin=True)  # for the causes' names
    note = ("The sum of the bars of a cause decides: it is named from the dashed line on.")
    return ["<h3>Evidence</h3>", paragraph(note, "note"), embed(figure, "plot-evidence")]


def _terms(result):
    """The open catalogue: what describes the misfit where no named effect does."""
    if not result.get("terms"):
        return []
    blocks = ["<h3>What describes the misfit</h3>",
              paragraph(f"Of {result['terms'][0]['tried']} terms. Each half of the flight predicts the "
                        "other one better with the size that it shows.")]
    for term in result["terms"]:
        halves = " and ".join(with_sigma(half["value"], half["sigma"]) for half in term["halves"])
        text = f"{term['text'][0].upper()}{term['text'][1:]} (p = {term['p_value']:.2g}; by halves {halves})."
        if term.get("physics"):
            text += f" Known physics of this form: {term['physics']}."
        alike = term.get("fits_alike") or []
        if alike:
            more = f" and {len(alike) - 3} more" if len(alike) > 3 else ""
            text += f" Fits alike: {'; '.join(alike[:3])}{more}."
        if term.get("instead_of"):
            text += (f" With it in the model little is left of {term['instead_of']}: they describe the "
                     "same misfit, and the model keeps the named cause.")
        for flight in term.get("other_flights") or []:
            size = f", {with_sigma(flight['value'], flight['sigma'])}" if "value" in flight else ""
            text += f" On {flight['log']}: {flight['outcome']}{size}."
        text += " model.yaml has it." if term["in_model"] else " model.yaml lacks it."
        blocks.append(paragraph(text))
    return blocks


def _what(result):
    return "disturbances" if result.get("drive") == "rotors" else "fixes' residual"


def _chance(confidence):
    p = 1.0 - confidence
    return f"p = {p:.2g}" if p > 1e-6 else "p below 1e-6"


def _cause(cause):
    rows = [[escape(name), with_sigma(p["value"], p["sigma"]) if "sigma" in p else number(p["value"]),
             escape(p["unit"])] for name, p in cause["parameters"].items()]
    repeated = {True: badge("confirmed"), False: badge("not confirmed")}.get(cause.get("confirmed"), "")
    blocks = [f"<h3>{escape(cause['id'])} {badge(_chance(cause['confidence']))} {repeated}</h3>",
              *([paragraph(sentence(cause["physics"]))] if cause.get("physics") else []),
              table([("parameter", 0), ("value", 1), ("unit", 0)], rows)]
    if cause.get("because"):
        blocks.append(paragraph(f"Not named: {cause['because']}."))
    witness = cause.get("witness")
    if witness and witness["text"] not in cause.get("because", ""):
        blocks.append(paragraph(f"Witness: {WITNESS[witness['says']]} ({witness['text']})."))
    for flight in cause.get("other_flights") or []:
        sizes = ", ".join(f"{name} {with_sigma(p['value'], p['sigma'])} {p['unit']}"
                          for name, p in (flight.get("parameters") or {}).items())
        blocks.append(paragraph(f"On {flight['log']}: {flight['outcome']}"
                                f"{', ' if sizes else ''}{sizes}."))
    if cause["confused_with"]:
        blocks.append(paragraph(f"Fits equally well: {', '.join(cause['confused_with'])}. "
                                f"To separate them: {cause['separate_by']}."))
    return blocks + _gains(cause)


def _gains(node):
    """Gain of a cause, or of all of them, on held-out flight."""
    blocks = []
    for key, what, count in (("gain", "Final-point error", "arcs"),
                             ("gain_open_loop", "Open-loop error over 1 s", "replays"),
                             ("gain_agreement", "", "seconds")):
        if key not in node or (key == "gain" and node[key]["metric"] == "open_loop_error_1s"):
            continue  # without arcs `gain` repeats `gain_open_loop`
        gain = node[key]
        held_out = f"{what} on {gain[count]} held-out {count}"
        unit = gain.get("unit", "m")
        if key == "gain_agreement":
            stream = gain["metric"].removeprefix("distance_from_").replace("_", " ")
            held_out = f"Distance of the corrected stream from {stream} over {gain[count]} s of held-out flight"
        elif gain["metric"] not in ("final_point_error", "open_loop_error_1s"):
            held_out = f"Open-loop error over 0.5 s on {gain[count]} s of held-out flight"
        interval = "too few for an interval"
        if "interval95" in gain:
            low, high = gain["interval95"]
            interval = f"95 % interval of the gain: {number(low)} to {number(high)} {unit}"
        blocks.append(paragraph(f"{held_out}: {number(gain['before'])} {unit} before, "
                                f"{number(gain['after'])} {unit} after ({interval})."))
    return blocks


def _detectable(size):
    """No vehicle has an effect of a thousand units (SI): the flight does not show it."""
    return number(size, 2) if size < 1e3 else "not shown"


def _noise_tiles(result):
    residual = result["residual"]
    return tiles([(number(residual["rms_before"]), f"{_what(result)} before, sigma"),
                  (number(residual["rms_after"]), "after, each in its own learned noise"),
                  ("yes" if residual["white"] else "no", "residual white")])


def _candidates(result):
    headers = [("effect", 0), ("score z", 1), ("p", 1), ("detectable from", 0)]
    rows = [[escape(c.get("which", c["id"])), number(c["score_z"]), number(c["p_value"], 2),
             escape(", ".join(f"{n} {_detectable(v)}" for n, v in c["detectable_size"].items()))]
            for c in result["candidates"]]
    note = ("Every effect, tested alone on the base fit. The size in the last column would have been "
            "found with 95 % power; smaller ones may be there unseen.")
    tested = f"{len(rows)} candidates, each with the size from which on it would have been found"
    return [details(tested, paragraph(note, "note") + table(headers, rows))]


def _residuals(result, folder):
    frame = read_table(folder / "residuals.csv", ["t", "x_before", "y_before", "x_after", "y_after"],
                       ["kind"])
    blocks = []
    if "white" in result["residual"]:
        blocks.append(paragraph(_whiteness(result), "note"))
    for kind, what in (("fix", "Fixes"), ("force", "Accelerometer, x and y"),
                       ("specific_force", "Specific force that the model lacks, x and y"),
                       ("angular_acceleration", "Angular acceleration that the model lacks, x and y")):
        part = decimate(frame[frame.kind == kind], 1500)
        if part.empty:
            continue
        figure = go.Figure()
        for when, colour in (("before", BAD), ("after", FIXES)):
            for axis in "xy":
                figure.add_scattergl(x=part.t, y=part[f"{axis}_{when}"], mode="markers",
                                     name=f"{axis} {when}",
                                     marker=dict(color=colour, size=4,
                                                 symbol="circle" if axis == "x" else "diamond"))
        style(figure, 320, xaxis_title="time [s]", yaxis_title="residual [sigma]")
        blocks += [f"<h3>{what}</h3>", embed(figure, f"plot-{kind}")]
    return blocks


def _whiteness(result):
    residual = result["residual"]
    chances = [f"{number(residual[key], 2)} {when}"
               for key, when in (("whiteness_p_before", "before"), ("whiteness_p", "after"))
               if key in residual]
    neighbours = "half seconds" if result.get("drive") == "rotors" else "fixes"
    return ("Residuals of the fit, with what the model leaves out (gusts, drifts) fitted beside it. "
            f"Whiteness is tested by the products of neighbouring {neighbours}: their sum over its own "
            f"scatter is normal where the residual is white. Chance of as much: {', '.join(chances)}.")
