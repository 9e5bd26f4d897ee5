"""Tables of numbers as HTML: methods by measures, to be sorted by any."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape

from mitex.comparison.html import DASH, number_text
from mitex.comparison.measures import Measure
from mitex.comparison.results import title_of
from mitex.comparison.summary import Cell, Summary


def table_html(table: Summary, floor: Mapping[str, float]) -> str:
    """A table with its title.

    Args:
        table: means and spreads.
        floor: measure -> value of the exemplar beside itself, for the last row; empty for none.
    """
    title = "Means over all of them" if table.pair is None else title_of(*table.pair)
    head = "<tr><th><button>method</button></th>" + "".join(map(_head, table.measures)) + "</tr>"
    rows = "".join(_row(table, method) for method in table.methods)
    foot = f"<tfoot><tr><td>exemplar beside itself</td>{_floor(table, floor)}</tr></tfoot>" if floor else ""
    content = f"<thead>{head}</thead><tbody>{rows}</tbody>{foot}"
    return f'<h3>{escape(title)}</h3><div class="wide"><table class="numbers">{content}</table></div>'


def meaning_html(measure: Measure) -> str:
    """What a measure means, as a term and its description."""
    better = f" <span>{escape(measure.better)}</span>" if measure.better else ""
    return f"<dt>{escape(measure.label)}{better}</dt><dd>{escape(measure.meaning)}</dd>"


def _head(measure: Measure) -> str:
    better = escape(measure.better) or "&nbsp;"
    return f"<th><button>{escape(measure.label)}</button><small>{better}</small></th>"


def _row(table: Summary, method: str) -> str:
    cells = "".join(_cell(table.cells.get((method, measure.key)), measure) for measure in table.measures)
    return f'<tr><td data-value="{escape(method)}">{escape(method)}</td>{cells}</tr>'


def _cell(cell: Cell | None, measure: Measure) -> str:
    """A number, with what it is sorted by: how far it is from the best that is possible."""
    if cell is None:
        return f'<td data-value="">{DASH}</td>'
    value = measure.distance(cell.mean) if measure.distance else cell.mean
    spread = f"± {number_text(cell.spread * measure.scale, 2)}" if cell.count > 1 and cell.spread else ""
    mark = ' class="best"' if cell.best else ""
    mean = number_text(cell.mean * measure.scale)
    return f'<td data-value="{value:.9g}"{mark}>{mean}<span class="spread">{spread}</span></td>'


def _floor(table: Summary, values: Mapping[str, float]) -> str:
    known = (values.get(measure.key) for measure in table.measures)
    return "".join(f"<td>{DASH if value is None else number_text(value)}</td>" for value in known)
