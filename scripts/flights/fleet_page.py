"""The page of many flights: which vehicle needs a look, parameters over time, flights without result."""
import plotly.graph_objects as go

from charts import embed, style
from history import first_changes
from page import Page, details, escape, paragraph


def html_table(frame):
    head = "".join(f"<th>{escape(column)}</th>" for column in frame.columns)
    rows = "".join("<tr>" + "".join(f"<td>{escape(value)}</td>" for value in row) + "</tr>"
                   for row in frame.itertuples(index=False))
    return f'<table class="table"><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>'


def over_time(table, look):
    """Value with its 95 % interval against the date: vehicles to look at in colour, the others grey."""
    figure = go.Figure()
    for vehicle, group in sorted(table.groupby("vehicle"), key=lambda item: item[0] in look):
        group = group.sort_values("date")
        shown = vehicle in look
        figure.add_scatter(
            x=group.date.tolist(), y=group.value.tolist(), name=escape(vehicle),
            mode="markers+lines" if shown else "markers", showlegend=shown,
            text=[escape(flight) for flight in group.flight], hovertemplate="%{text}: %{y:.4g}",
            marker=dict(size=7 if shown else 5, **({} if shown else {"color": "#c6cfda"})),
            error_y=dict(type="data", array=(1.96 * group.sigma).tolist(), thickness=1, width=0,
                         **({} if shown else {"color": "#e9edf2"})))
    unit = table.unit.iloc[0]
    return style(figure, 340, yaxis_title=f"{escape(table.parameter.iloc[0])} [{escape(unit)}]")


def _add_history(page, compared, trims):
    """Where a flight has earlier ones: the first that differs from them, and the trims over time."""
    if not (compared.outcome != "not compared").any():
        return
    firsts = first_changes(compared)
    changed = set(firsts[firsts.differ > 0].vehicle)
    charts = [embed(over_time(group, changed), f"plot-trim-{number}")
              for number, (_, group) in enumerate(trims.groupby("parameter"))]
    differing = compared[compared.outcome.isin(["differs", "wrong log"])].drop(columns="earlier")
    page.add("history", "What has changed, and when", paragraph(
        "Each flight against the earlier ones of its vehicle (trueline diagnose --against; a day is "
        "a session), each with a chance of 1 % of being named without cause. Colour: vehicles with a "
        "flight that differs. Trim: mean command of a motor in steady flight.", "note"),
        html_table(firsts), *charts,
        *([details("all flights that differ, and wrong logs", html_table(differing))] if len(differing) else []))


def fleet_page(flights, table, rows, vehicles, compared, trims):
    page = Page("Flights", f"{len(flights)} flights of {len(vehicles)} vehicles")
    look = set(vehicles[vehicles.look == "yes"].vehicle)
    note = ("A vehicle needs a look if a parameter of it stands out from the fleet, drifts with "
            "the date, or is unlike its other flights, or if a cause is named on more of its "
            "flights than chance allows. All these tests together give a fleet without a defect "
            "one such vehicle with a chance of 1 %.")
    page.add("vehicles", "Vehicles", paragraph(note, "note"), html_table(vehicles))
    _add_history(page, compared, trims)
    known = table[table.status.isin(["identified", "weak"])]
    charts = [embed(over_time(group, look), f"plot-{number}")
              for number, (_, group) in enumerate(known.groupby("parameter"))]
    page.add("parameters", "Parameters over time", paragraph(
        "Bars are 95 % intervals of the flights. Grey: vehicles without a reason to look.", "note"),
        *charts)
    if len(rows):
        means = rows.round(5).drop(columns=["farthest"])
        page.add("means", "Means and drifts", details("one row a vehicle and parameter",
                                                      html_table(means)))
    failed = flights[flights.failed != ""][["flight", "vehicle", "date", "failed"]]
    page.add("failed", "Flights without a result",
             html_table(failed) if len(failed) else paragraph("None."))
    page.add("cost", "Cost", paragraph(
        f"A flight took {flights.cpu_seconds.median():.1f} s of one core in the median, "
        f"{flights.cpu_seconds.sum() / 3600.0:.2f} h all together, and at most "
        f"{flights.memory_mb.max():.0f} MB."))
    return page
