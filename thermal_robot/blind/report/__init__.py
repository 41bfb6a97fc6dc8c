"""Report of a trial's score: text, page, Markdown and figures."""
