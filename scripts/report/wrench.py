"""The page of a force and moment experiment, flight by flight."""
from page import Page, escape, paragraph
from tables import fitted_numbers, number, table
from yaml_file import read_mapping

FORCE, MOMENT = ("fx", "fy", "fz", "F"), ("tx", "ty", "tz", "M")


def build(arguments):
    summary = read_mapping(arguments.result / "summary.yaml")
    page = Page(str(summary["name"]), str(summary.get("about", "")))
    page.add("scores", "Root mean square errors", _scores(summary["scores"]), paragraph(
        "F and M: over the three components. The truth depends on the mass; the last reading takes "
        "out the best gain on fz and the mean of every error.", "note"))
    for index, fold in enumerate(summary["folds"]):
        page.add(f"numbers-{index}", f"Numbers for {fold['test']}", fitted_numbers(fold["numbers"]), paragraph(
            f"Fitted to {', '.join(map(str, fold['train']))}, {fold['rows']} rows. One standard deviation by "
            "the spread between sections of 5 s. " + _moment(fold), "note"))
    return page


def _moment(fold):
    share, washout = fold["share_of_moment"], fold["moment_washout"]
    return ("Of the model's moment about roll and pitch what is faster than "
            f"{number(washout['washout'])} s turns the vehicle, late by {number(washout['lag'])} s: "
            f"{number(share['roll'])} and {number(share['pitch'])} of it; of the moment about yaw "
            f"{number(share['yaw'])}. The rest cancels moments that no log shows.")


def _scores(scores):
    headers = [("Flight", False), ("Predictor", False), ("Fitted to flights", True),
               ("Truth", False)]
    headers += [(f"{k} [N]", True) for k in FORCE] + [(f"{k} [N m]", True) for k in MOMENT]
    return table(headers, [
        [escape(s["flight"]), escape(s["predictor"]), str(s.get("fitted_to", "")), escape(s["truth"]),
         *(number(s["force"][k]) for k in FORCE), *(number(s["moment"][k]) for k in MOMENT)]
        for s in scores])
