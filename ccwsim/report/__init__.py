"""Reports as one HTML file for offline use, with text, tables, pictures, charts and judgements."""

from ccwsim.model import check_installed

check_installed("jinja2")
