"""Tables of numbers as HTML: methods by measures, to be sorted by any."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape

from mitex.comparison.html import DASH, count_text, number_text
from mitex.comparison.measures import Measure
from mitex.comparison.summary import Cell, Summary


def table_html(table: Summary, floor: Mapping[str, float], title: str) -> str:
    """A table with its title.

    Args:
        table: means and spreads.
        floor: measure -> value of the exemplar beside itself, for the last row; empty for none.
        title: what it is of.
    """
    names = "<th><button>method</button></th><th><button>seeds</button><small>&nbsp;</small></th>"
    head = f"<tr>{names}{''.join(map(_head, table.measures))}</tr>"
    rows = "".join(_row(table, method) for method in table.methods)
    foot = (
        f"<tfoot><tr><td>exemplar beside itself</td><td></td>{_floor(table, floor)}</tr></tfoot>"
        if floor
        else ""
    )
    content = f"<thead>{head}</thead><tbody>{rows}</tbody>{foot}"
    return f'<h3>{escape(title)}</h3><div class="wide"><table class="numbers">{content}</table></div>'


def meaning_html(measure: Measure) -> str:
    """What a measure means, as a term and its description."""
    better = f" <span>{escape(measure.better)}</span>" if measure.better else ""
    return f"<dt>{escape(measure.label)}{better}</dt><dd>{escape(measure.meaning)}</dd>"


def _head(measure: Measure) -> str:
    better = escape(measure.better + (", sorted by distance" if measure.two_sided else "")) or "&nbsp;"
    return f"<th><button>{escape(measure.label)}</button><small>{better}</small></th>"


def _row(table: Summary, method: str) -> str:
    cells = [table.cells.get((method, measure.key)) for measure in table.measures]
    seeds = max((cell.count for cell in cells if cell), default=0)
    columns = "".join(
        _cell(cell, measure, seeds) for cell, measure in zip(cells, table.measures, strict=True)
    )
    name = f'<td data-value="{escape(method)}">{escape(method)}</td>'
    return f'<tr>{name}<td data-value="{seeds}">{seeds or DASH}</td>{columns}</tr>'


def _cell(cell: Cell | None, measure: Measure, seeds: int) -> str:
    """A number, with what it is sorted by: how far values are from the best that is possible, on average.

    That is told, too, where opposite errors cancel in the number, and how many seeds it is of, if not of all
    of the row's.
    """
    if cell is None:
        return f'<td data-value="">{DASH}</td>'
    value = cell.distance if measure.distance else cell.mean
    mark = ' class="best"' if cell.best else ""
    mean, spread = number_text(cell.mean * measure.scale), _spread(cell.spread * measure.scale)
    if cell.count != seeds:
        spread = f"{spread} of {count_text(cell.count, 'seed')}".lstrip()
    distance = f'<span class="spread">{_distance(cell, measure)}</span>' if measure.two_sided else ""
    return f'<td data-value="{value:.9g}"{mark}>{mean}<span class="spread">{spread}</span>{distance}</td>'


def _distance(cell: Cell, measure: Measure) -> str:
    spread = _spread(cell.distance_spread * measure.scale)
    return f"distance {number_text(cell.distance * measure.scale)} {spread}".rstrip()


def _spread(value: float) -> str:
    """Nothing where there is none."""
    return f"± {number_text(value, 2)}" if value > 0 else ""


def _floor(table: Summary, values: Mapping[str, float]) -> str:
    known = (values.get(measure.key) for measure in table.measures)
    return "".join(f"<td>{DASH if value is None else number_text(value)}</td>" for value in known)
