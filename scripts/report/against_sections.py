"""The page of trueline diagnose --against: what is named, the trims, and all that was tried."""
import numpy as np
import plotly.graph_objects as go

from charts import BAD, FIXES, embed, style
from csv_table import read_table
from page import escape, paragraph, sentence, verdict
from tables import bullets, number, table, tiles

VERDICTS = {"clean": "The flight lies within what flights of this vehicle scatter by.",
            "ambiguous": "The vehicle has changed. A load has the same trim as what is named.",
            "unexplained": "The trim has changed in a way that no cause tried explains."}
KINDS = {"clean": "good", "ambiguous": "fair", "unexplained": "bad"}


def add_to(page, result, folder, beside=False):
    """The sections; `beside` others of a diagnosis of the whole log."""
    of = " by the trim" if beside else ""
    page.add("trim-verdict", f"Result{of}", *_verdict(result))
    page.add("trims", "Trims", *_trims(result, folder))
    page.add("trim-candidates", f"What was tried{of}", *_candidates(result))


def _verdict(result):
    references = result["references"]
    blocks = [verdict(KINDS[result["verdict"]], f"{result['verdict'].capitalize()}. {VERDICTS[result['verdict']]}",
                      [_sentence(cause) for cause in result["causes"]]),
              tiles([(str(references["flights"]), "reference flights"),
                     (str(references["sessions"]), "sessions of them")])]
    causes = result["causes"] or result.get("first") or []
    if causes:
        first = "" if result["causes"] else f"Nothing is named. What stands first: {causes[0]['text']}."
        evidence = (f" The natural logarithm of the likelihood ratio is {causes[0]['evidence']['total']:.1f};"
                    f" {result['evidence_needed']:.1f} is needed to name a cause.")
        blocks += [paragraph(first.replace("+-", "±") + evidence),
                   paragraph(f"To separate them: {causes[0]['separate_by']}.")]
    if not result["causes"] and result.get("if_same_session"):
        blocks.append(paragraph("If the flight is of the references' session: "
                                + _sentence(result["if_same_session"][0])))
    blocks.append(paragraph(sentence(references["text"])))
    if result.get("warnings"):
        blocks.append(bullets(result["warnings"]))
    return blocks


def _sentence(cause):
    return sentence(cause["text"].replace("+-", "±"))


def _trims(result, folder):
    single = [c for c in result["candidates"] if c["id"] == "rotor_loss" and "+" not in c["which"]]
    channels = [f"u{k + 1}" for k in range(max(1, len(single)))]
    trims = read_table(folder / "trims.csv", [*channels, *(f"sigma_{c}" for c in channels)], ["log"])
    speeds = any("w" in c["which"] for c in single)  # trims are of squares of speeds, which thrust goes with
    figure = go.Figure()
    for k in range(len(trims["log"])):
        judged = k == 0
        y, sigma = (np.array([trims[name + c][k] for c in channels]) for name in ("", "sigma_"))
        if speeds:
            y, sigma = np.sqrt(y), 0.5 * sigma / np.sqrt(y)
        figure.add_scatter(x=[c.replace("u", "w" if speeds else "u") for c in channels], y=y,
                           error_y={"array": 1.96 * sigma}, mode="markers", name=escape(trims["log"][k]),
                           marker={"color": BAD if judged else FIXES, "size": 12 if judged else 7})
    style(figure, 420, showlegend=False)
    figure.update_yaxes(title_text="root mean square speed [rad/s]" if speeds else "mean command [1]")
    return [paragraph(f"{'Speed of each rotor' if speeds else 'Mean command of each motor'} in steady "
                      "flight, with 95 % of its scatter within the flight: red this flight, the others its references.",
                      "note"), embed(figure, "plot-trims")]


def _candidates(result):
    rows = [[escape(c["id"]), escape(c["which"]), number(c["evidence"]), number(c["p_value"]),
             _numbers(c, "estimate"), _numbers(c, "sigma"), _numbers(c, "detectable_size")]
            for c in result["candidates"]]
    return [table([("cause", 0), ("which", 0), ("evidence", 1), ("p", 1), ("size", 1), ("sigma", 1),
                   ("detectable", 1)], rows)]


def _numbers(candidate, key):
    return ", ".join(number(v) for values in candidate[key].values() for v in values)
