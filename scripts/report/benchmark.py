"""The page of trueline benchmark: figures 11 to 13 of Li et al. 2019 and the sweeps, with the
paper's figures beside ours."""
import plots_benchmark as plots
import plots_over_time as over_time
from benchmark_result import read_benchmark
from benchmark_sections import (convergence_table, failures, group_table, headline, paper_table,
                                seeds_in_words, starts_table)
from calibration_sections import provenance
from charts import embed
from page import Page, paragraph


def build(arguments):
    result = read_benchmark(arguments.result)
    page = Page(str(result.summary.get("name", "Benchmark")), "estimators side by side")
    page.add("result", "Result", *headline(result), failures(result))
    if not result.has_sweep:
        page.add("paper", "Beside the paper", *paper_table(result))
    if not result.arcs.empty:
        for anchor, title, blocks in _figures(result):
            page.add(anchor, title, *blocks)
    page.add("numbers", "Numbers", *group_table(result))
    seeds_in_words(result)
    page.add("provenance", "Provenance", *provenance(result))
    return page


def _figures(result):
    """(anchor, title, blocks) of every figure that the result has data for."""
    if result.has_sweep:
        yield "sweep", "Sweep", _sweep(result)
    elif result.arcs.groupby("label").gamma.nunique().max() > 1:
        yield "gamma", "Length of the window", _gamma(result)
    if not result.has_sweep:
        yield "arcs", "Arc by arc", _arcs(result)
    if not result.has_sweep and len(result.logs) > 1:
        yield "logs", "Flight by flight", [
            paragraph("Boxes: quartiles and median of the final-point error; whiskers: 1.5 times "
                      "the interquartile range; dots: arcs beyond.", "note"),
            embed(plots.by_log(result), "plot-logs")]
    if not result.paths.label.isin(["truth", "fixes"]).all():
        yield "track", "Whole flight", [
            paragraph("From above, in the NED earth frame. Solid lines were fitted, dotted lines "
                      "were predicted blind to the next fix.",
                      "note"),
            embed(plots.track(result), "plot-track"),
            paragraph("Position and velocity over time, as figures 12 and 13 of the paper have them.",
                      "note"),
            embed(over_time.states(result), "plot-states")]
    for anchor, title, names in over_time.BIASES:
        if over_time.has(result, names):
            yield anchor, title, [
                paragraph("The estimate at the end of each pass, with one sigma (shaded); dashes: "
                          "the truth.", "note"),
                embed(over_time.estimates(result, names), f"plot-{anchor}")]
    if not result.convergence.empty:
        yield "convergence", "Convergence", _convergence(result)
    if result.summary.get("starts"):
        yield "starts", "Random starts", [starts_table(result)]


def _floor(result):
    if result.arcs.bound.notna().any():
        return (" Black dashes: the Cramer-Rao bound, the least root mean square that an estimator "
                "can reach with the model, the noise and the fixes of one window; the mean of such "
                "an estimator lies at 0.89 of it, the median at 0.83. A filter remembers more than "
                "one window and may come below.")
    return ""


def _gamma(result):
    return [paragraph("Grey dots: single arcs. Lines join the means, diamonds are medians." +
                      _floor(result), "note"),
            embed(plots.against_gamma(result), "plot-gamma")]


def _arcs(result):
    flights = result.arcs.groupby("log").seed.nunique().max()
    note = "Final-point error of each arc."
    if flights > 1:
        note = f"Medians over {flights} flights, with interquartile bands."
    return [paragraph(note + _floor(result), "note"),
            embed(plots.by_arc(result), "plot-arcs")]


def _sweep(result):
    return [paragraph("Medians over all arcs, with interquartile bands." + _floor(result), "note"),
            embed(plots.over_sweep(result), "plot-sweep")]


def _convergence(result):
    note = ("Share of flights on which a quantity has come to stay inside its tolerance of the "
            "truth, against the time since the first fix. Windows give one estimate a pass, so "
            "times come in steps of a few seconds.")
    return [convergence_table(result), paragraph(note, "note"),
            embed(plots.convergence(result), "plot-convergence")]
