"""The page of trueline calibrate: verdict, parameters, track, errors, residuals, provenance."""
from pathlib import Path

import plots_arcs
import plots_parameters
import plots_residuals
import plots_track
from calibration_result import read_calibration
from calibration_sections import (arc_summary, headline, parameter_table, provenance,
                                  residual_table, unobservable, whole_flight)
from charts import embed
from flight_log import read_log
from page import Page, paragraph
from truth_file import read_truth


def add_arguments(parser):
    parser.add_argument("--log", required=True, type=Path, help="the native log it was made from")


def build(arguments):
    result = read_calibration(arguments.result)
    log = read_log(arguments.log)
    truth = read_truth(arguments.log)
    page = Page(f"Calibration of {log.name}",
                f"{result.estimator}, windows of {result.gamma} passes")
    page.add("verdict", "Result", *headline(result))
    page.add("parameters", "Parameters", *_parameters(result, truth))
    if whole := whole_flight(result, truth):
        page.add("whole-flight", "Whole flight", *whole)
    page.add("track", "Track", *_track(result, log))
    page.add("errors", "Errors", *_errors(result))
    page.add("residuals", "Residuals", *_residuals(result))
    page.add("provenance", "Provenance", *provenance(result))
    return page


def _parameters(result, truth):
    blocks = [parameter_table(result.summary.get("parameters"), truth),
              unobservable(result.summary)]
    if truth:
        blocks.append(paragraph("Truth: from the file beside the simulated log; dashes in the "
                                "pictures. Drifting errors and biases by their mean.", "note"))
    if not result.windows[result.windows.gamma == result.gamma].value.dropna().empty:
        blocks += [
            "<h3>By window</h3>",
            paragraph("Bars are 95 % intervals. Filled: identified; hollow circle: weak; triangle: "
                      "at a bound, and cross: unobservable, both without an interval.", "note"),
            embed(plots_parameters.parameters_by_window(result, truth), "plot-parameters")]
    return blocks


def _track(result, log):
    if log.fixes.empty and log.mocap.empty and result.trajectory.empty:
        return [paragraph("The log has no positions to draw.")]
    note = ("From above, in the NED earth frame. Solid lines were fitted, dotted lines were "
            "predicted blind from the pass before; each ends in its 95 % ellipse. Click an entry "
            "of the legend to hide or show it, drag to zoom, double-click to see all.")
    return [paragraph(note, "note"), embed(plots_track.track(result, log), "plot-track")]


def _errors(result):
    if result.arcs.empty:
        return [paragraph("There is no arc: nothing was predicted.")]
    blocks = [arc_summary(result)]
    if result.arcs.final_point_error.notna().any():
        blocks += ["<h3>By arc</h3>",
                   paragraph(f"Windows of gamma = {result.gamma} passes.", "note"),
                   embed(plots_arcs.errors_by_arc(result), "plot-arcs")]
    gammas = sorted({int(g) for g in result.arcs.gamma})
    note = "Each dot is an arc; lines join the means, diamonds are medians."
    if len(gammas) == 1:
        note += f" This result holds gamma = {gammas[0]} only."
    return blocks + ["<h3>Against the length of the window</h3>", paragraph(note, "note"),
                     embed(plots_arcs.against_gamma(result), "plot-gamma")]


def _residuals(result):
    residuals = plots_residuals.whitened(result)
    if residuals.empty:
        return [paragraph("No fix was fitted.")]
    note = ("Residuals of the fixes against the fitted path, divided by each fix's own sigma; each "
            "fix once, from the first window that holds it. If the assumed noise is right, 95 % "
            "lie between the dashed lines and the histogram follows the curve.")
    return [paragraph(note, "note"), residual_table(residuals),
            embed(plots_residuals.over_time(residuals), "plot-residuals"),
            embed(plots_residuals.histogram(residuals), "plot-histogram")]
