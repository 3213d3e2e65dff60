"""HTML tables, badges and tiles."""
import math

from page import escape


def table(headers, rows):
    """`headers`: (text, is_number) pairs; `rows`: lists of HTML cells."""
    def cells(tag, values):
        return "".join(f'<{tag} class="{"number" if number else ""}">{value}</{tag}>'
                       for value, (_, number) in zip(values, headers))
    head = cells("th", [escape(text) for text, _ in headers])
    body = "".join(f"<tr>{cells('td', row)}</tr>" for row in rows)
    return (f'<div class="scroll"><table><thead><tr>{head}</tr></thead>'
            f"<tbody>{body}</tbody></table></div>")


def fitted_numbers(numbers, folds=None):
    """Of a model of forces: each with its sigma where it was fitted; `folds`: fits that leave out one flight."""
    folds = folds or {}
    rows = [[f"<code>{escape(name)}</code>",
             with_sigma(entry["value"], entry["sigma"]) if entry["status"] == "fitted" else number(entry["value"]),
             escape(entry["unit"]), escape(entry["status"]), escape(entry["about"]),
             *(number(fold["numbers"][name]["value"]) for fold in folds.values())]
            for name, entry in numbers.items()]
    return table([("Number", False), ("Value", True), ("Unit", False), ("Status", False), ("Meaning", False),
                  *((f"without {name}", True) for name in folds)], rows)


def badge(status):
    return f'<span class="badge {escape(status)}">{escape(str(status).replace("_", " "))}</span>'


def tiles(items):
    """`items`: (value, what it is) pairs, as text."""
    content = "".join(f'<div class="tile"><b>{escape(v)}</b><span>{escape(w)}</span></div>'
                      for v, w in items)
    return f'<div class="tiles">{content}</div>'


def bullets(items):
    return f"<ul>{''.join(f'<li>{escape(item)}</li>' for item in items)}</ul>" if items else ""


def as_number(value):
    """A float, NaN where there is none."""
    try:
        return float(value)
    except (TypeError, ValueError):
        return math.nan


def number(value, digits=3, unit=""):
    """Text with `digits` significant digits; an en dash where there is no finite number."""
    value = as_number(value)
    if not math.isfinite(value):
        return "–"
    plain = value == 0 or 1e-3 <= abs(value) < 1e5
    text = f"{value:.{digits}g}" if plain else f"{value:.2e}"
    return f"{text.replace('-', '−')} {unit}".strip()


def to_digits_of(sigma, *values):
    """Texts of values to the decimals of two significant digits of sigma; None where there is no such sigma."""
    sigma = as_number(sigma)
    if not (math.isfinite(sigma) and sigma > 0 and all(map(math.isfinite, values))):
        return None
    decimals = max(0, 1 - math.floor(math.log10(sigma)))
    if decimals > 9:
        return [number(value) for value in values]
    return [f"{value:.{decimals}f}".replace("-", "−") for value in values]


def with_sigma(value, sigma):
    """`value ± sigma`."""
    value, sigma = as_number(value), as_number(sigma)
    texts = to_digits_of(sigma, value, sigma)
    return " ± ".join(texts) if texts else number(value)


def interval_95(value, sigma):
    """The ends of the 95 % interval of a normal distribution."""
    texts = to_digits_of(sigma, value - 1.96 * sigma, value + 1.96 * sigma)
    return " to ".join(texts) if texts else "–"


def percent(share):
    share = as_number(share)
    return f"{100 * share:.0f} %" if math.isfinite(share) else "–"
