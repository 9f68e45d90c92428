"""Fields, text, errors and themes for all pages; nothing here depends on a session."""

from ccwsim.ui.widgets.errors import (
    PENDING_ERROR,
    catch_callback_errors,
    if_possible,
    is_control_flow,
    problem_in,
    user_message,
)
from ccwsim.ui.widgets.facts import draw_facts, facts_of, proportions_table, write_facts
from ccwsim.ui.widgets.fields import (
    PARAMETER_ROWS,
    Download,
    bound_to,
    button,
    download,
    field,
    help_of,
    menu,
    options_of,
)
from ccwsim.ui.widgets.text import (
    documents,
    how_tos,
    in_row,
    numbers_table,
    on_a_page,
    page_labels,
    page_text,
    pair,
    panel_title,
    plain,
    scrolled,
    step_note,
    step_title,
    verdict_html,
)
from ccwsim.ui.widgets.theme import chart_theme, draw_style, own_colours, theme_name
