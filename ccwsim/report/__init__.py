"""Reports as one HTML file that works offline: text, tables, pictures, charts, judgements."""

from ccwsim.report.document import (
    Block,
    Chart,
    Code,
    Document,
    Facts,
    Judgement,
    Judgements,
    Picture,
    Row,
    Section,
    Table,
    Text,
    Tone,
    report_html,
    surroundings,
    write_report,
)

__all__ = [
    "Block",
    "Chart",
    "Code",
    "Document",
    "Facts",
    "Judgement",
    "Judgements",
    "Picture",
    "Row",
    "Section",
    "Table",
    "Text",
    "Tone",
    "report_html",
    "surroundings",
    "write_report",
]
