"""Components that run in the browser, each a folder of JavaScript, HTML, CSS and Python."""
