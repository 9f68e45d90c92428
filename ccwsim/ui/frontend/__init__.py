"""Components that run in the browser: a folder each, with JavaScript, HTML, CSS and Python."""
